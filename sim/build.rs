//! Passes the folder of the embedded files to the library: `tests/extras` compiles the same sources from
//! another folder.

use std::{env, path::Path};

fn main() {
    println!("cargo:rerun-if-env-changed=CARGO_MANIFEST_DIR");
    let package = env::var("CARGO_MANIFEST_DIR").expect("Cargo says where the package is");
    let places = ["assets", "../../sim/assets"].map(|place| Path::new(&package).join(place));
    let assets = places.iter().find(|place| place.is_dir()).expect("the folder sim/assets");
    println!("cargo:rustc-env=TANDEM_SIM_ASSETS={}", assets.display());
}
