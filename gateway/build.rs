//! Passes the compiler's version to the program, for `tandem bench`, and packs the script of the pages.

use std::{env, fs, io::Write, path::Path, process::Command};

use flate2::{Compression, write::GzEncoder};

const SCRIPT: &str = "web/dist/page.js";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = Command::new(rustc).arg("--version").output().ok();
    let said = version.and_then(|output| String::from_utf8(output.stdout).ok()).unwrap_or_default();
    let profile = env::var("PROFILE").unwrap_or_default();
    println!("cargo:rustc-env=TANDEM_RUSTC={}", said.trim());
    println!("cargo:rustc-env=TANDEM_PROFILE={profile}");
    println!("cargo:rerun-if-changed={SCRIPT}");
    pack_script();
}

/// Writes the script, compressed by gzip, to the build's output folder.
fn pack_script() {
    let script = fs::read(SCRIPT).expect("the script of the pages");
    let folder = env::var("OUT_DIR").expect("Cargo says where to write");
    let file = fs::File::create(Path::new(&folder).join("page.js.gz")).expect("a file");
    let mut packed = GzEncoder::new(file, Compression::best());
    packed.write_all(&script).and_then(|()| packed.finish()).expect("the packed script");
}
