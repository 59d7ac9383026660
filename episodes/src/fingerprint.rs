//! The identity of this build. Two builds of one version may differ in physics, so one build must not
//! continue what another began.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use xxhash_rust::xxh3::Xxh3;

/// Bytes read at a time: a program is tens of megabytes.
const PART_BYTES: usize = 64 << 10;

/// Path of the program's own file, if it is not the file that the system runs.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// Names the file that identifies the program, for a host that has loaded it as a library. The library's
/// file distinguishes builds, and the host's does not. Later calls have no effect.
pub fn name_program(path: PathBuf) {
    PROGRAM.get_or_init(|| path);
}

/// Returns the version and the hash of the program's own file. The hash is computed on the first call.
///
/// # Errors
///
/// If the file cannot be read.
pub fn build() -> io::Result<&'static str> {
    static BUILD: OnceLock<String> = OnceLock::new();
    /// Lock that makes concurrent callers wait for the first one's hash.
    static READING: Mutex<()> = Mutex::new(());
    let _reading = READING.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(build) = BUILD.get() {
        return Ok(build);
    }
    let hash = match PROGRAM.get() {
        Some(path) => hash(path)?,
        None => hash(&std::env::current_exe()?)?,
    };
    Ok(BUILD.get_or_init(|| format!("{}+{hash:016x}", env!("CARGO_PKG_VERSION"))))
}

fn hash(path: &Path) -> io::Result<u64> {
    let (mut file, mut hasher) = (File::open(path)?, Xxh3::new());
    let mut part = vec![0; PART_BYTES];
    loop {
        match file.read(&mut part) {
            Ok(0) => return Ok(hasher.digest()),
            Ok(length) => hasher.update(&part[..length]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use xxhash_rust::xxh3::xxh3_64;

    use super::*;

    #[test]
    fn a_file_has_the_hash_of_its_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("program");
        for length in [0, 1, PART_BYTES, 3 * PART_BYTES + 7] {
            let bytes: Vec<u8> = (0..length).map(|i| (i * i) as u8).collect();
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(hash(&path).unwrap(), xxh3_64(&bytes), "{length} bytes");
        }
        assert!(hash(&folder.path().join("none")).is_err());
    }
}
