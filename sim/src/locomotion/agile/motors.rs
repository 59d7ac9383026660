//! Control of all of a robot's motors by a policy, as in a program for a real G1: with the policy's gains,
//! and without a base controller.

use std::sync::Arc;

use super::joints::JointMap;
use super::network::{Network, RecurrentState};
use super::observe;
use crate::body::{BodyEstimate, MotorSetpoints, UPPER, UPPER_JOINTS, joint_names};
use crate::locomotion::{BaseCommand, MotorController};

/// Gains (N m/rad, N m s/rad) of the joints that the policy does not control. The first entry whose text
/// occurs in a joint's name applies. LeRobot sends these gains to a G1.
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
}

impl MotorController for MotorPolicy {
    fn act(
        &mut self,
        body: &BodyEstimate,
        upper_rad: &[f32; UPPER_JOINTS],
        base: &BaseCommand,
    ) -> MotorSetpoints {
        for (column, joint) in UPPER.into_iter().enumerate() {
            self.setpoints.q_rad[joint] = upper_rad[column];
        }
        let velocity_command = [base.vx_m_s, base.vy_m_s, base.yaw_rate_rad_s];
        let observation = observe(body, &body.q_rad, velocity_command, &self.joints);
        // A network that ran when it was loaded will run again. If it ever fails, the last setpoints hold.
        if let Ok((action, memory)) = self.network.run(&observation, &self.memory)
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
