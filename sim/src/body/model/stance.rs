//! The rest posture of a robot: legs bent as much as a G1's, with the soles flat under the centre of mass.

use rapier3d::math::{Pose, Vector};

use super::RobotModel;
use crate::Side;
use crate::body::layout::{JOINTS, LEG_JOINTS, LEGS};

/// Leg joints that bend the leg.
const HIP: usize = 0;
const KNEE: usize = 3;
const ANKLE: usize = 4;
const HALVINGS: usize = 30;
const NEWTON_STEPS: usize = 12;
const STEP_RAD: f32 = 0.02;

impl RobotModel {
    /// Bends the legs to their rest angles; all other joints keep theirs.
    pub(super) fn bend_legs(&mut self, g1: &RobotModel) {
        let wanted = g1.extension(&g1.rest_rad());
        let mut q_rad: [f32; JOINTS] = std::array::from_fn(|joint| self.joints[joint].rest_rad);
        LEGS.into_iter().for_each(|first| q_rad[first..first + LEG_JOINTS].fill(0.0));
        let [least_rad, most_rad] = self.knee_range_rad();
        let (mut low_rad, mut high_rad) = (least_rad.max(0.0), most_rad);
        for _ in 0..HALVINGS {
            let middle_rad = 0.5 * (low_rad + high_rad);
            self.bend(&mut q_rad, KNEE, middle_rad);
            if self.extension(&q_rad) > wanted { low_rad = middle_rad } else { high_rad = middle_rad }
        }
        self.bend(&mut q_rad, HIP, -0.5 * low_rad);
        self.bend(&mut q_rad, ANKLE, -0.5 * low_rad);
        // Newton's method, with finite differences for derivatives.
        for _ in 0..NEWTON_STEPS {
            let off = self.off_balance(&q_rad);
            let [by_hip, by_ankle] = [HIP, ANKLE].map(|index| {
                let mut turned_rad = q_rad;
                self.bend(&mut turned_rad, index, self.bent_rad(&q_rad, index) + STEP_RAD);
                (self.off_balance(&turned_rad) - off) / STEP_RAD
            });
            let determinant = by_hip.x * by_ankle.y - by_hip.y * by_ankle.x;
            if determinant.abs() < 1e-6 {
                break;
            }
            let hip_rad = (by_ankle.x * off.y - by_ankle.y * off.x) / determinant;
            let ankle_rad = (by_hip.y * off.x - by_hip.x * off.y) / determinant;
            for (index, change_rad) in [(HIP, hip_rad), (ANKLE, ankle_rad)] {
                let angle_rad = self.bent_rad(&q_rad, index) + change_rad;
                self.bend(&mut q_rad, index, angle_rad);
            }
        }
        for first in LEGS {
            for joint in &mut self.joints[first..first + LEG_JOINTS] {
                joint.rest_rad = 0.0;
            }
            for index in [HIP, KNEE, ANKLE] {
                let joint = &mut self.joints[first + index];
                joint.rest_rad = q_rad[first + index].clamp(joint.lower_rad, joint.upper_rad);
            }
        }
    }

    /// Returns the range of the left knee; bending backwards is positive.
    pub(super) fn knee_range_rad(&self) -> [f32; 2] {
        let knee = &self.joints[LEGS.left + KNEE];
        match self.bends_positively(Side::Left, KNEE) {
            true => [knee.lower_rad, knee.upper_rad],
            false => [-knee.upper_rad, -knee.lower_rad],
        }
    }

    /// Sets a joint of both legs to an angle about the lateral axis, which points left.
    fn bend(&self, q_rad: &mut [f32; JOINTS], index: usize, angle_rad: f32) {
        for side in Side::BOTH {
            let positive = self.bends_positively(side, index);
            q_rad[LEGS[side] + index] = if positive { angle_rad } else { -angle_rad };
        }
    }

    /// Returns the angle of the left leg's joint about the lateral axis.
    fn bent_rad(&self, q_rad: &[f32; JOINTS], index: usize) -> f32 {
        let angle_rad = q_rad[LEGS.left + index];
        if self.bends_positively(Side::Left, index) { angle_rad } else { -angle_rad }
    }

    /// Returns true if the axis of a leg's joint points left with all joints at 0.
    fn bends_positively(&self, side: Side, index: usize) -> bool {
        let joint = &self.joints[LEGS[side] + index];
        let poses = self.forward_kinematics(Pose::IDENTITY, &[0.0; JOINTS]);
        (poses[joint.link].rotation * joint.axis).y >= 0.0
    }

    /// Returns the extension of the left leg: distance from hip to ankle, as a share of its length.
    fn extension(&self, q_rad: &[f32]) -> f32 {
        let [hip_m, ankle_m] = [self.left_hip(), LEG_JOINTS - 1].map(|index| self.leg_joint_m(index, q_rad));
        (ankle_m - hip_m).length() / self.leg_m()
    }

    /// Returns the balance errors. x: distance of the centre of mass ahead of the left sole's centre
    /// (m); y: downward pitch of that sole's toes (rad).
    fn off_balance(&self, q_rad: &[f32]) -> Vector {
        let poses = self.forward_kinematics(Pose::IDENTITY, q_rad);
        let moments = self.links.iter().zip(&poses);
        let com_m: Vector =
            moments.map(|(link, pose)| *pose * link.mass.local_com * (link.mass.mass() / self.mass_kg)).sum();
        let sole = poses[self.soles.left.link] * self.soles.left.link_from_site;
        let ahead = sole.rotation * Vector::X;
        Vector::new(com_m.x - sole.translation.x, (-ahead.z).atan2(ahead.x), 0.0)
    }
}
