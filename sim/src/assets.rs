//! MJCF files that the binary carries: `robots/<name>/robot.xml`, `scenes/<name>.xml`, `objects/<name>.xml`.

use include_dir::{Dir, include_dir};

use crate::SimError;

static ASSETS: Dir = include_dir!("$TANDEM_SIM_ASSETS");

/// The robot used unless another file is given.
pub const DEFAULT_ROBOT: &str = "g1_dex3";

/// Text of an embedded robot file.
pub fn robot(name: &str) -> Result<&'static str, SimError> {
    text("robot", "robots", name, &format!("robots/{name}/robot.xml"))
}

/// Text of an embedded scene file.
pub fn scene(name: &str) -> Result<&'static str, SimError> {
    text("scene", "scenes", name, &format!("scenes/{name}.xml"))
}

/// Text of an embedded object file.
pub fn object(name: &str) -> Result<&'static str, SimError> {
    text("object", "objects", name, &format!("objects/{name}.xml"))
}

fn text(kind: &'static str, folder: &str, name: &str, path: &str) -> Result<&'static str, SimError> {
    ASSETS.get_file(path).and_then(|file| file.contents_utf8()).ok_or_else(|| SimError::UnknownAsset {
        kind,
        name: name.into(),
        have: names(folder).join(", "),
    })
}

fn names(folder: &str) -> Vec<String> {
    let Some(dir) = ASSETS.get_dir(folder) else { return Vec::new() };
    let mut names: Vec<String> = dir
        .entries()
        .iter()
        .filter_map(|entry| entry.path().file_stem())
        .map(|stem| stem.to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
