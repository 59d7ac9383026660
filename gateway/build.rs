//! Passes the compiler's version to the program, for `tandem bench`.

use std::{env, process::Command};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = Command::new(rustc).arg("--version").output().ok();
    let said = version.and_then(|output| String::from_utf8(output.stdout).ok()).unwrap_or_default();
    let profile = env::var("PROFILE").unwrap_or_default();
    println!("cargo:rustc-env=TANDEM_RUSTC={}", said.trim());
    println!("cargo:rustc-env=TANDEM_PROFILE={profile}");
}
