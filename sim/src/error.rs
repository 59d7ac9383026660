//! Errors of a world.

use std::path::Path;

use crate::dynamics::{Diverged, OtherWorld, TreeError};

/// Error of loading or of a step. The text names the file or body and a remedy.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    #[error("no {kind} `{name}`; have: {have}")]
    UnknownAsset { kind: &'static str, name: String, have: String },
    #[error("cannot read `{path}`: {source}")]
    Read { path: String, source: std::io::Error },
    #[error("`{file}` is not valid MJCF: {source}")]
    Mjcf { file: String, source: mjcf_rs::ParseError },
    #[error("`{file}` is not valid XML: {source}; `tandem import` converts files of other formats to MJCF")]
    Xml { file: String, source: roxmltree::Error },
    #[error("`{file}` does not describe a robot: {source}")]
    RobotDescription { file: String, source: Box<dyn std::error::Error + Send + Sync> },
    #[error("`{path}` is not a mesh that can be read: {source}")]
    Mesh { path: String, source: Box<dyn std::error::Error + Send + Sync> },
    #[error("mesh file `{path}` is of a kind that is not read; use .obj, .stl or .msh")]
    MeshKind { path: String },
    #[error("`{path}` is not a picture that can be read: {source}; use .png")]
    Texture { path: String, source: Box<dyn std::error::Error + Send + Sync> },
    #[error("`{file}`: {what}")]
    Unsupported { file: String, what: String },
    #[error("{} things are not read:{}", .0.len(), listed(.0))]
    Several(Vec<SimError>),
    #[error(
        "this build cannot read `{path}`: ONNX policies are an extra; build with `cargo build --release \
         --features onnx`"
    )]
    WithoutOnnx { path: String },
    #[error(
        "controller `{name}` drives legs and waist alone; a velocity policy without `looped:` can drive all \
         motors"
    )]
    NoMotorController { name: String },
    #[error(
        "this build cannot draw on a graphics processor: that is an extra; build with `cargo build --release \
         --features gpu`"
    )]
    WithoutGpu,
    #[error(
        "`{path}` is not an ONNX file ({source}); a velocity policy for the G1 as AGILE exports it would work"
    )]
    NotOnnx { path: String, source: Box<dyn std::error::Error + Send + Sync> },
    #[error(
        "`{path}` has no {kind} `{tensor}`; a velocity policy for the G1 needs it; this file has: {have}"
    )]
    MissingTensor { path: String, kind: &'static str, tensor: String, have: String },
    #[error("`{path}`: {kind} `{tensor}` has shape {have:?}; a velocity policy for the G1 has {expected:?}")]
    TensorShape { path: String, kind: &'static str, tensor: String, have: Vec<usize>, expected: Vec<usize> },
    #[error("`{path}` cannot be run: {source}")]
    NotRunnable { path: String, source: Box<dyn std::error::Error + Send + Sync> },
    #[error("`{path}` gives targets that are not numbers, or gains that are not positive")]
    PolicyOutput { path: String },
    #[error("a mechanism cannot be built: {0}")]
    Tree(#[from] TreeError),
    #[error(transparent)]
    Diverged(#[from] Diverged),
    #[error("snapshot cannot be restored: {0}")]
    OtherWorld(#[from] OtherWorld),
    #[error("snapshot cannot be read: {0}; it must come from this binary and this world")]
    Snapshot(#[from] postcard::Error),
}

/// Maximum number of errors that [`SimError::Several`] prints.
const MAX_TOLD: usize = 40;

impl SimError {
    /// Combines all errors of a file into one; `None` if there are none.
    pub(crate) fn of_all(errors: Vec<SimError>) -> Option<SimError> {
        (!errors.is_empty()).then(|| SimError::several(errors))
    }

    /// Combines errors into one.
    pub(crate) fn several(errors: Vec<SimError>) -> SimError {
        let mut all: Vec<SimError> = Vec::new();
        for error in errors {
            match error {
                SimError::Several(errors) => all.extend(errors),
                other => all.push(other),
            }
        }
        match all.len() {
            1 => all.remove(0),
            _ => SimError::Several(all),
        }
    }

    /// Returns the error of a file that cannot be read.
    pub(crate) fn unreadable(path: &Path, source: std::io::Error) -> SimError {
        SimError::Read { path: path.display().to_string(), source }
    }
}

fn listed(errors: &[SimError]) -> String {
    let mut text: String = errors.iter().take(MAX_TOLD).map(|error| format!("\n  {error}")).collect();
    if errors.len() > MAX_TOLD {
        text += &format!("\n  and {} more", errors.len() - MAX_TOLD);
    }
    text
}
