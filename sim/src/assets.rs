//! MJCF files embedded in the binary: `robots/<name>/robot.xml`, `scenes/<name>.xml`, `objects/<name>.xml`.

use std::sync::LazyLock;

use include_dir::{Dir, include_dir};

use crate::SimError;

static ASSETS: Dir = include_dir!("$TANDEM_SIM_ASSETS");

/// The robot used unless another file is given.
pub const DEFAULT_ROBOT: &str = "g1_dex3";

/// Name of the robot with the effort limits of Unitree's URDF in place of those of its MJCF, which disagree:
/// 35 N m in place of 50 at ankles, waist roll and waist pitch.
pub const URDF_EFFORTS_ROBOT: &str = "g1_dex3_urdf_efforts";

pub const ROBOTS: [&str; 2] = [DEFAULT_ROBOT, URDF_EFFORTS_ROBOT];

static URDF_EFFORTS: LazyLock<Option<String>> = LazyLock::new(|| {
    let own = robot(DEFAULT_ROBOT).ok()?;
    Some(own.replace(r#"forcerange="-50 50""#, r#"forcerange="-35 35""#))
});

/// Returns the text of an embedded robot file.
///
/// # Errors
///
/// Returns an error with the available names if there is no such robot.
pub fn robot(name: &str) -> Result<&'static str, SimError> {
    // The text is derived from the default's, so it is built only for this name.
    if name == URDF_EFFORTS_ROBOT
        && let Some(text) = URDF_EFFORTS.as_deref()
    {
        return Ok(text);
    }
    text("robot", "robots", name, &format!("robots/{name}/robot.xml"))
}

/// Returns the text of an embedded scene file.
///
/// # Errors
///
/// Returns an error with the available names if there is no such scene.
pub fn scene(name: &str) -> Result<&'static str, SimError> {
    text("scene", "scenes", name, &format!("scenes/{name}.xml"))
}

/// Returns the text of an embedded object file.
///
/// # Errors
///
/// Returns an error with the available names if there is no such object.
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
    if folder == "robots" {
        names.push(URDF_EFFORTS_ROBOT.into());
    }
    names.sort();
    names
}
