//! Which program this is. Two builds of one version may differ in physics, so what one has begun another must not go on with.

use std::io;
use std::sync::OnceLock;

use xxhash_rust::xxh3::xxh3_64;

/// Version and hash of the program's own file, as it was when first asked for.
pub fn build() -> io::Result<&'static str> {
    static BUILD: OnceLock<String> = OnceLock::new();
    if let Some(build) = BUILD.get() {
        return Ok(build);
    }
    let hash = xxh3_64(&std::fs::read(std::env::current_exe()?)?);
    Ok(BUILD.get_or_init(|| format!("{}+{hash:016x}", env!("CARGO_PKG_VERSION"))))
}
