//! Position loop of stepping: it compensates a steady gait that falls a little short of its command.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

use crate::body::BodyScale;
use crate::locomotion::BaseVelocity;
use crate::plane::flat;

const POSITION_GAIN_1_S: f32 = 1.0;
const BIAS_GAIN_1_S2: f32 = 1.0;
const LARGEST_CORRECTION_M_S: [f32; 2] = [0.3, 0.12];
/// Maximum distance by which the reference may lead the robot. A robot that was pushed farther off its path
/// does not return to the reference.
const LEASH_M: f32 = 0.15;
const LARGEST_ERROR_M: f32 = 0.3;

/// Reference position of the pelvis, and the learned deficit of the velocity command.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Course {
    reference_m: Vector,
    bias_m_s: [f32; 2],
}

impl Course {
    pub(super) fn from(pelvis_m: Vector) -> Course {
        Course { reference_m: pelvis_m, bias_m_s: [0.0; 2] }
    }

    /// Returns the velocity to plan with: the command, plus the velocity that brings the pelvis back to
    /// its reference. While `starts` is true the robot gathers speed, and its lag is not compensated.
    pub(super) fn corrected_velocity(
        &mut self,
        scale: &BodyScale,
        velocity: BaseVelocity,
        starts: bool,
        pelvis_m: Vector,
        [ahead, left]: [Vector; 2],
        dt_s: f32,
    ) -> [f32; 2] {
        // A robot that is commanded to stop takes its present position as reference and drops the bias, which
        // was learned in another direction of motion.
        let stopping = velocity == BaseVelocity::STILL;
        if starts || stopping {
            self.reference_m = pelvis_m;
        }
        if stopping {
            self.bias_m_s = [0.0; 2];
        }
        self.reference_m += (ahead * velocity.vx_m_s + left * velocity.vy_m_s) * dt_s;
        let mut error_m = flat(self.reference_m - pelvis_m);
        let leash_m = scale.length_m(LEASH_M);
        if error_m.length() > leash_m {
            error_m *= leash_m / error_m.length();
            self.reference_m = pelvis_m + error_m;
        }
        let error_m = [error_m.dot(ahead), error_m.dot(left)];
        let command_m_s = [velocity.vx_m_s, velocity.vy_m_s];
        std::array::from_fn(|i| {
            let most_m_s = scale.speed_m_s(LARGEST_CORRECTION_M_S[i]);
            if !starts {
                let most_m = scale.length_m(LARGEST_ERROR_M);
                let felt_m = error_m[i].clamp(-most_m, most_m);
                self.bias_m_s[i] = (self.bias_m_s[i] + scale.rate_1_s2(BIAS_GAIN_1_S2) * felt_m * dt_s)
                    .clamp(-most_m_s, most_m_s);
            }
            let pull = (scale.rate_1_s(POSITION_GAIN_1_S) * error_m[i]).clamp(-most_m_s, most_m_s);
            command_m_s[i] + pull + self.bias_m_s[i]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f32 = 1.0 / 200.0;
    const AXES: [Vector; 2] = [Vector::X, Vector::Y];

    /// A gait that reaches 80 % of its command ends up at the commanded velocity.
    #[test]
    fn a_slow_gait_is_told_to_hurry() {
        let command = BaseVelocity { vx_m_s: 0.3, ..BaseVelocity::STILL };
        let (mut course, mut pelvis_m) = (Course::from(Vector::ZERO), Vector::ZERO);
        let mut told_m_s = [0.0; 2];
        for _ in 0..6000 {
            told_m_s = course.corrected_velocity(&BodyScale::G1, command, false, pelvis_m, AXES, DT_S);
            pelvis_m += Vector::X * (0.8 * told_m_s[0] * DT_S);
        }
        assert!((0.8 * told_m_s[0] - 0.3).abs() < 1e-3 && told_m_s[1] == 0.0, "{told_m_s:?}");
    }

    #[test]
    fn a_stop_forgets_and_a_push_is_not_walked_back() {
        let mut course = Course::from(Vector::ZERO);
        let far_m = Vector::X * -5.0;
        let command = BaseVelocity { vx_m_s: 0.2, ..BaseVelocity::STILL };
        let mut told = |command, pelvis_m| {
            course.corrected_velocity(&BodyScale::G1, command, false, pelvis_m, AXES, DT_S)
        };
        let told_m_s = told(command, far_m);
        assert!((told_m_s[0] - 0.2 - POSITION_GAIN_1_S * LEASH_M).abs() < 1e-3, "{told_m_s:?}");
        assert_eq!(told(BaseVelocity::STILL, Vector::Y), [0.0; 2]);
    }
}
