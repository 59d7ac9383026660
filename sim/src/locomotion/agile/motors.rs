//! The policy at a robot's motors, as a program for a real G1 runs it: with its own gains, and with nothing
//! under it.

use std::sync::Arc;

use super::joints::JointMap;
use super::network::{Network, NetworkInputs, RecurrentState};
use crate::body::{MotorSetpoints, UPPER, joint_names};
use crate::locomotion::MotorController;
use crate::robot::{Robot, RobotCommand};

/// Gains (N m/rad, N m s/rad) of the joints that the policy does not control, by the first part of a name
/// that occurs in theirs. LeRobot sends these to a G1.
const HELD: [(&str, [f32; 2]); 5] = [
    ("waist_yaw", [250.0, 5.0]),
    ("wrist", [40.0, 1.5]),
    ("thumb_0", [3.0, 0.1]),
    ("hand", [2.0, 0.06]),
    ("", [80.0, 3.0]),
];

/// A policy that drives legs, waist roll and waist pitch; the other joints are held at their commands.
pub(in crate::locomotion) struct MotorPolicy {
    network: Arc<Network>,
    joints: JointMap,
    memory: RecurrentState,
    setpoints: MotorSetpoints,
}

impl MotorPolicy {
    pub(in crate::locomotion) fn new(network: Arc<Network>) -> MotorPolicy {
        let memory = network.blank();
        let mut setpoints = MotorSetpoints::LIMP;
        for (joint, name) in joint_names().iter().enumerate() {
            let held = HELD.iter().find(|(part, _)| name.contains(part));
            [setpoints.kp_n_m_rad[joint], setpoints.kd_n_m_s_rad[joint]] =
                held.map_or([0.0; 2], |(_, gains)| *gains);
        }
        MotorPolicy { network, joints: JointMap::new(), memory, setpoints }
    }

    fn observe(&self, robot: &Robot, command: &RobotCommand) -> NetworkInputs {
        let pelvis = robot.estimate().world_from_pelvis.rotation;
        let readings = robot.readings().last().expect("a robot has readings from its start");
        let base = command.base;
        NetworkInputs {
            quaternion_wxyz: [pelvis.w, pelvis.x, pelvis.y, pelvis.z],
            angular_velocity_rad_s: readings.gyro_rad_s.to_array(),
            velocity_command: [base.vx_m_s, base.vy_m_s, base.yaw_rate_rad_s],
            q_rad: self.joints.observed.map(|joint| readings.joints.q_rad[joint]),
            qd_rad_s: self.joints.observed.map(|joint| readings.joints.qd_rad_s[joint]),
        }
    }
}

impl MotorController for MotorPolicy {
    fn act(&mut self, robot: &Robot, command: &RobotCommand) -> MotorSetpoints {
        for (column, joint) in UPPER.into_iter().enumerate() {
            self.setpoints.q_rad[joint] = command.upper_rad[column];
        }
        // A network that ran when it was loaded will run again. If it ever fails, the last setpoints hold.
        if let Ok((action, memory)) = self.network.run(&self.observe(robot, command), &self.memory)
            && action.usable()
        {
            for (index, joint) in self.joints.controlled.into_iter().enumerate() {
                self.setpoints.q_rad[joint] = action.target_rad[index];
                self.setpoints.kp_n_m_rad[joint] = action.kp_n_m_rad[index];
                self.setpoints.kd_n_m_s_rad[joint] = action.kd_n_m_s_rad[index];
            }
            self.memory = memory;
        }
        self.setpoints.clone()
    }
}
