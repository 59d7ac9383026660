//! Which base controller the robots of a world get.

use std::path::Path;
#[cfg(feature = "onnx")]
use std::sync::Arc;

#[cfg(feature = "onnx")]
use super::{Agile, Network};
use super::{Balance, BaseLimits, Locomotion};
use crate::SimError;
use crate::body::{BodyScale, RobotModel};

/// Cheap to clone: a file is read and checked once, and robots share its network.
#[derive(Clone, Debug, Default)]
pub enum LocomotionChoice {
    /// Our own.
    #[default]
    Balance,
    /// A velocity policy that was read from an ONNX file, and whether a loop over its place is around it.
    #[cfg(feature = "onnx")]
    Onnx { network: Arc<Network>, looped: bool },
}

impl LocomotionChoice {
    /// The policy of a file. `looped`: it is told not the commands, but what keeps the robot where they would have taken it.
    pub fn from_file(path: &Path, looped: bool) -> Result<LocomotionChoice, SimError> {
        from_onnx(path, looped)
    }

    /// A fresh controller for one robot.
    pub fn controller(&self) -> Box<dyn Locomotion> {
        match self {
            LocomotionChoice::Balance => Box::new(Balance::default()),
            #[cfg(feature = "onnx")]
            LocomotionChoice::Onnx { network, looped } => Box::new(Agile::new(network.clone(), *looped)),
        }
    }

    /// Base commands that such a controller follows with a robot of this size.
    pub fn limits(&self, scale: &BodyScale) -> BaseLimits {
        self.controller().limits(scale)
    }

    /// Whether such a controller can move this robot; the text says why not.
    #[cfg(feature = "onnx")]
    pub fn check_robot(&self, model: &RobotModel) -> Result<(), String> {
        match self {
            LocomotionChoice::Balance => Ok(()),
            LocomotionChoice::Onnx { .. } => Agile::check_robot(model),
        }
    }

    /// Whether such a controller can move this robot; ours can.
    #[cfg(not(feature = "onnx"))]
    pub fn check_robot(&self, _model: &RobotModel) -> Result<(), String> {
        match self {
            LocomotionChoice::Balance => Ok(()),
        }
    }

    /// What recordings and results call it: `balance`, or the file's name with a hash of its content, and the loop if there is one.
    pub fn name(&self) -> String {
        match self {
            LocomotionChoice::Balance => "balance".into(),
            #[cfg(feature = "onnx")]
            LocomotionChoice::Onnx { network, looped: false } => network.name().into(),
            #[cfg(feature = "onnx")]
            LocomotionChoice::Onnx { network, looped: true } => format!("looped:{}", network.name()),
        }
    }
}

#[cfg(feature = "onnx")]
fn from_onnx(path: &Path, looped: bool) -> Result<LocomotionChoice, SimError> {
    Ok(LocomotionChoice::Onnx { network: Arc::new(Network::from_file(path)?), looped })
}

#[cfg(not(feature = "onnx"))]
fn from_onnx(path: &Path, _looped: bool) -> Result<LocomotionChoice, SimError> {
    Err(SimError::WithoutOnnx { path: path.display().to_string() })
}
