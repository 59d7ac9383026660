//! Execution of one control step by the robots.

use serde::{Deserialize, Serialize};
use tandem_sim::dynamics::Diverged;
use tandem_sim::{MotorSetpoints, RobotCommand, Step, World};

/// Commands of all robots for one control step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Executed {
    /// Command of each robot.
    pub commands: Vec<RobotCommand>,
    /// Setpoints of each robot's motors, which replace its command; empty if no robot has any.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub setpoints: Vec<Vec<MotorSetpoints>>,
}

impl Executed {
    /// Makes the control step.
    ///
    /// # Errors
    ///
    /// [`Diverged`] if physics diverged.
    pub fn step(&self, world: &mut World) -> Result<Step, Diverged> {
        for (robot, setpoints) in self.setpoints.iter().enumerate().filter(|(_, given)| !given.is_empty()) {
            world.drive_motors(robot, setpoints);
        }
        world.control_step(&self.commands)
    }
}
