//! Which base controller the robots of a world get.

use std::path::Path;
#[cfg(feature = "onnx")]
use std::sync::Arc;

#[cfg(feature = "onnx")]
use super::{Agile, Network};
use super::{Balance, BaseLimits, Locomotion};
use crate::SimError;

/// Cheap to clone: a file is read and checked once, and robots share its network.
#[derive(Clone, Debug, Default)]
pub enum LocomotionChoice {
    /// Our own.
    #[default]
    Balance,
    /// A velocity policy that was read from an ONNX file.
    #[cfg(feature = "onnx")]
    Onnx(Arc<Network>),
}

impl LocomotionChoice {
    /// The policy of a file, or our own controller without one.
    pub fn from_file(path: Option<&Path>) -> Result<LocomotionChoice, SimError> {
        Ok(match path {
            Some(path) => from_onnx(path)?,
            None => LocomotionChoice::Balance,
        })
    }

    /// A fresh controller for one robot.
    pub fn controller(&self) -> Box<dyn Locomotion> {
        match self {
            LocomotionChoice::Balance => Box::new(Balance::default()),
            #[cfg(feature = "onnx")]
            LocomotionChoice::Onnx(network) => Box::new(Agile::new(network.clone())),
        }
    }

    /// Base commands that such a controller follows.
    pub fn limits(&self) -> BaseLimits {
        self.controller().limits()
    }

    /// What recordings and results call it: `balance`, or the file's name with a hash of its content.
    pub fn name(&self) -> &str {
        match self {
            LocomotionChoice::Balance => "balance",
            #[cfg(feature = "onnx")]
            LocomotionChoice::Onnx(network) => network.name(),
        }
    }
}

#[cfg(feature = "onnx")]
fn from_onnx(path: &Path) -> Result<LocomotionChoice, SimError> {
    Ok(LocomotionChoice::Onnx(Arc::new(Network::from_file(path)?)))
}

#[cfg(not(feature = "onnx"))]
fn from_onnx(path: &Path) -> Result<LocomotionChoice, SimError> {
    Err(SimError::WithoutOnnx { path: path.display().to_string() })
}
