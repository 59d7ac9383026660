//! The choice of the base controller for the robots of a world.

use std::path::Path;
#[cfg(feature = "onnx")]
use std::sync::Arc;

#[cfg(feature = "onnx")]
use super::{Agile, Network, agile::MotorPolicy};
use super::{Balance, BaseLimits, Locomotion, MotorController};
use crate::SimError;
use crate::body::{BodyScale, RobotModel};

/// Choice of a base controller. Clones are cheap: a file is read and checked once, and robots share its
/// network.
#[derive(Clone, Debug, Default)]
pub enum LocomotionChoice {
    /// Tandem's own controller.
    #[default]
    Balance,
    /// A velocity policy from an ONNX file, with a position loop if `looped` is true.
    #[cfg(feature = "onnx")]
    Onnx { network: Arc<Network>, looped: bool },
}

impl LocomotionChoice {
    /// Reads the policy of a file. If `looped` is true, a position loop replaces the commands: the policy
    /// receives the velocity that keeps the robot at the place to which the commands would have moved it.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be used, or if the crate was built without the feature `onnx`.
    pub fn from_file(path: &Path, looped: bool) -> Result<LocomotionChoice, SimError> {
        from_onnx(path, looped)
    }

    /// Creates a controller for one robot.
    pub fn controller(&self) -> Box<dyn Locomotion> {
        match self {
            LocomotionChoice::Balance => Box::new(Balance::default()),
            #[cfg(feature = "onnx")]
            LocomotionChoice::Onnx { network, looped } => Box::new(Agile::new(network.clone(), *looped)),
        }
    }

    /// Creates a controller of all motors of one robot.
    ///
    /// # Errors
    ///
    /// Returns an error unless the choice is a policy without a loop.
    pub fn motor_controller(&self) -> Result<Box<dyn MotorController>, SimError> {
        match self {
            #[cfg(feature = "onnx")]
            LocomotionChoice::Onnx { network, looped: false } => {
                Ok(Box::new(MotorPolicy::new(network.clone())))
            }
            _ => Err(SimError::NoMotorController { name: self.name() }),
        }
    }

    /// Returns the base commands that the controller follows with a robot of this size.
    pub fn limits(&self, scale: &BodyScale) -> BaseLimits {
        self.controller().limits(scale)
    }

    /// Checks that the controller can move this robot.
    ///
    /// # Errors
    ///
    /// Returns the reason as text if it cannot.
    #[cfg(feature = "onnx")]
    pub fn check_robot(&self, model: &RobotModel) -> Result<(), String> {
        match self {
            LocomotionChoice::Balance => Ok(()),
            LocomotionChoice::Onnx { .. } => Agile::check_robot(model),
        }
    }

    /// Checks that the controller can move this robot, which Tandem's own controller always can.
    #[cfg(not(feature = "onnx"))]
    pub fn check_robot(&self, _model: &RobotModel) -> Result<(), String> {
        match self {
            LocomotionChoice::Balance => Ok(()),
        }
    }

    /// Returns the name in recordings and results: `balance`, or the file's name with a hash of its content.
    /// The prefix `looped:` marks a position loop.
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
