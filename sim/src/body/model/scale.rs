//! The size of a robot relative to the G1, for which the base controller's parameters were tuned.
//!
//! Consider two bodies that differ only in size, with length ratio l and mass ratio m. They move alike if
//! their time ratio is sqrt(l), because gravity is the same for both. The ratio of accelerations is then 1,
//! of speeds sqrt(l), of forces m, and of torques m l (Froude's similarity). Where bodies differ in more than
//! size, in soles and hips, each of these has its own ratio.

use rapier3d::math::{Pose, Vector};

use super::RobotModel;
use crate::body::layout::{JOINTS, LEG_JOINTS, LEGS};
use crate::{GRAVITY_M_S2, Side};

/// Ratios to the G1. Each method converts a value for the G1 to the value for this robot.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyScale {
    length_ratio: f32,
    time_ratio: f32,
    mass_ratio: f32,
    /// Excess height of the pelvis over that of a G1 scaled to this size.
    higher_m: f32,
    hip_width_ratio: f32,
    sole_length_ratio: f32,
    sole_width_ratio: f32,
    /// Excess width of a sole over that of a G1 scaled to this size.
    wider_sole_m: f32,
    /// Vector from the ankle roll link to the centre of its sole.
    pub sole_in_foot_m: Vector,
    /// Distances from the ankle at which its torque can hold the whole weight, ahead and to the side.
    pub ankle_reach_m: [f32; 2],
}

/// Relative excess of the feet's distance over the hips' width above which feet count as spread.
const SPREAD_SHARE: f32 = 0.1;
/// Share of an ankle's effort available for holding the robot.
const ANKLE_EFFORT_USED: f32 = 0.8;

impl BodyScale {
    /// The G1 itself. Its soles, not its ankles, limit its support.
    pub const G1: BodyScale = BodyScale {
        length_ratio: 1.0,
        time_ratio: 1.0,
        mass_ratio: 1.0,
        higher_m: 0.0,
        hip_width_ratio: 1.0,
        sole_length_ratio: 1.0,
        sole_width_ratio: 1.0,
        wider_sole_m: 0.0,
        sole_in_foot_m: Vector::new(0.035, 0.0, -0.035),
        ankle_reach_m: [f32::INFINITY; 2],
    };

    /// Computes the scale of a robot, whose legs must have their rest angles.
    pub(super) fn between(g1: &RobotModel, own: &RobotModel) -> BodyScale {
        let length_ratio = own.leg_m() / g1.leg_m();
        let [own_sole_m, g1_sole_m] = [own, g1].map(RobotModel::sole_half_extents_m);
        let joint = |index: usize| {
            let joint = &own.joints[LEGS.left + index];
            if joint.exists() { joint.effort_n_m } else { 0.0 }
        };
        // A foot whose ankle does not roll supports the robot at the middle of its sole.
        let rolls = own.joints[LEGS.left + LEG_JOINTS - 1].exists();
        let weight_n = own.mass_kg * GRAVITY_M_S2;
        BodyScale {
            length_ratio,
            time_ratio: length_ratio.sqrt(),
            mass_ratio: own.mass_kg / g1.mass_kg,
            higher_m: own.rest_height_m() - length_ratio * g1.rest_height_m(),
            hip_width_ratio: own.hip_width_m() / g1.hip_width_m(),
            sole_length_ratio: own_sole_m.x / g1_sole_m.x,
            sole_width_ratio: if rolls { own_sole_m.y / g1_sole_m.y } else { 0.0 },
            wider_sole_m: 2.0 * (own_sole_m.y - length_ratio * g1_sole_m.y),
            sole_in_foot_m: own.soles.left.link_from_site.translation * Vector::new(1.0, 0.0, 1.0),
            ankle_reach_m: [joint(4), joint(5)].map(|effort| ANKLE_EFFORT_USED * effort / weight_n),
        }
    }

    pub fn length_m(&self, g1_m: f32) -> f32 {
        g1_m * self.length_ratio
    }

    /// Scales a height of the pelvis over the ground.
    pub fn height_m(&self, g1_m: f32) -> f32 {
        g1_m * self.length_ratio + self.higher_m
    }

    /// Scales a height of the pelvis in double precision.
    pub fn precise_height_m(&self, g1_m: f64) -> f64 {
        g1_m * f64::from(self.length_ratio) + f64::from(self.higher_m)
    }

    /// Scales a lateral distance between feet that are as far apart as the hips.
    pub fn stance_width_m(&self, g1_m: f32) -> f32 {
        g1_m * self.hip_width_ratio
    }

    /// Scales a lateral distance between feet that keeps their soles apart.
    pub fn apart_m(&self, g1_m: f32) -> f32 {
        g1_m * self.length_ratio + self.wider_sole_m
    }

    /// Scales a distance along a sole.
    pub fn along_sole_m(&self, g1_m: f32) -> f32 {
        g1_m * self.sole_length_ratio
    }

    /// Scales a distance across a sole.
    pub fn across_sole_m(&self, g1_m: f32) -> f32 {
        g1_m * self.sole_width_ratio
    }

    pub fn time_s(&self, g1_s: f32) -> f32 {
        g1_s * self.time_ratio
    }

    /// Scales a rate per time, or an angular velocity.
    pub fn rate_1_s(&self, g1_1_s: f32) -> f32 {
        g1_1_s / self.time_ratio
    }

    /// Scales a stiffness per mass, or an angular acceleration.
    pub fn rate_1_s2(&self, g1_value: f32) -> f32 {
        g1_value / self.length_ratio
    }

    /// Scales an angle per length.
    pub fn per_length(&self, g1_rad_m: f32) -> f32 {
        g1_rad_m / self.length_ratio
    }

    pub fn speed_m_s(&self, g1_m_s: f32) -> f32 {
        g1_m_s * self.time_ratio
    }

    pub fn force_n(&self, g1_n: f32) -> f32 {
        g1_n * self.mass_ratio
    }

    /// Scales a moment, or a stiffness about an axis.
    pub fn moment_n_m(&self, g1_n_m: f32) -> f32 {
        g1_n_m * (self.mass_ratio * self.length_ratio)
    }

    /// Scales a damping about an axis.
    pub fn damping_n_m_s(&self, g1_n_m_s: f32) -> f32 {
        g1_n_m_s * (self.mass_ratio * self.length_ratio * self.time_ratio)
    }

    pub fn inertia_kg_m2(&self, g1_kg_m2: f32) -> f32 {
        g1_kg_m2 * (self.mass_ratio * self.length_ratio * self.length_ratio)
    }
}

impl RobotModel {
    /// Returns the origin of a joint of the left leg in the pelvis frame, with the joints as in `q_rad`.
    pub(super) fn leg_joint_m(&self, index: usize, q_rad: &[f32]) -> Vector {
        let poses = self.forward_kinematics(Pose::IDENTITY, q_rad);
        poses[self.joints[LEGS.left + index].link].translation
    }

    /// Returns the length of a leg from the hip over the knee to the ankle.
    pub(super) fn leg_m(&self) -> f32 {
        let [hip_m, knee_m, ankle_m] =
            [self.left_hip(), 3, LEG_JOINTS - 1].map(|i| self.leg_joint_m(i, &[0.0; JOINTS]));
        (knee_m - hip_m).length() + (ankle_m - knee_m).length()
    }

    fn hip_width_m(&self) -> f32 {
        let [hip_m, foot_m] =
            [self.left_hip(), LEG_JOINTS - 1].map(|index| self.leg_joint_m(index, &[0.0; JOINTS]).y);
        // If the legs spread below the hip, the distance of the feet counts.
        if (foot_m - hip_m).abs() > SPREAD_SHARE * hip_m { foot_m } else { hip_m }
    }

    /// Returns the index of the hip's joint among those of the left leg.
    pub(super) fn left_hip(&self) -> usize {
        self.hip(Side::Left) - LEGS.left
    }

    /// Returns the height of the pelvis over the soles at rest.
    fn rest_height_m(&self) -> f32 {
        let poses = self.forward_kinematics(Pose::IDENTITY, &self.rest_rad());
        let sole = &self.soles[Side::Left];
        -(poses[sole.link] * sole.link_from_site).translation.z
    }

    fn sole_half_extents_m(&self) -> Vector {
        let corners_m = &self.sole_corners_m.left;
        let low_m = corners_m.iter().fold(Vector::INFINITY, |low, corner_m| low.min(*corner_m));
        let high_m = corners_m.iter().fold(Vector::NEG_INFINITY, |high, corner_m| high.max(*corner_m));
        (high_m - low_m) * 0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::posed::model;

    /// A robot described like the G1 has the scale of the G1, except for ankles stronger than the G1 needs.
    #[test]
    fn the_g1_has_the_scale_of_a_g1() {
        let own = BodyScale::between(model(), model());
        assert!(own.ankle_reach_m.iter().all(|reach_m| *reach_m > 0.1), "{own:?}");
        assert_eq!(BodyScale { ankle_reach_m: BodyScale::G1.ankle_reach_m, ..own }, BodyScale::G1);
    }

    /// A body four times as long and twice as heavy is slower by a factor of two.
    #[test]
    fn numbers_go_with_their_units() {
        let scale =
            BodyScale { length_ratio: 4.0, time_ratio: 2.0, mass_ratio: 2.0, higher_m: 0.1, ..BodyScale::G1 };
        assert_eq!((scale.length_m(0.5), scale.time_s(3.0), scale.speed_m_s(0.3)), (2.0, 6.0, 0.6));
        assert_eq!((scale.rate_1_s(3.0), scale.rate_1_s2(100.0), scale.per_length(2.0)), (1.5, 25.0, 0.5));
        assert_eq!(
            (scale.force_n(10.0), scale.moment_n_m(3.0), scale.damping_n_m_s(3.0)),
            (20.0, 24.0, 48.0)
        );
        assert_eq!((scale.inertia_kg_m2(1.0), scale.height_m(0.5)), (32.0, 2.1));
        // A stiffness about an axis holds a weight at a distance: both scale alike.
        let weight_n_m = scale.force_n(1.0) * scale.length_m(1.0);
        assert_eq!(scale.moment_n_m(1.0), weight_n_m);
    }
}
