//! Arm motion, drawn from the random numbers of a seed.

use tandem_sim::body::{
    ARM_COLUMNS, ARM_JOINTS, ARMS, HAND_COLUMNS, HAND_JOINTS, JointModel, MIRRORED_ARM, RobotModel,
    UPPER_JOINTS,
};
use tandem_sim::{Sides, SplitMix64};

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Arms {
    /// Held out, with small random motion.
    Forward,
    /// Held out like `Forward`, with wide swings of every joint.
    Waving,
    /// Held out like `Forward`, with fingers and thumbs that close from [`CLOSES_AT_S`] on.
    Closing,
}

/// Angles of the left arm (shoulder pitch, roll and yaw, elbow, wrist) that hold the hand a forearm's length
/// ahead of the chest.
const FORWARD_LEFT_RAD: [f32; ARM_JOINTS] = [-0.35, 0.2, 0.0, 0.3, 0.0, 0.0, 0.0];
const RAISE_S: f32 = 1.5;
/// Time at which hands begin to close. Fists press on themselves as on a load, because the targets are beyond
/// the joint ranges.
const CLOSES_AT_S: f32 = 4.0;
const CLOSING_S: f32 = 0.3;
const FIST_LEFT_RAD: [f32; HAND_JOINTS] = [0.0, 0.0, 2.3, -2.1, -2.3, -2.1, -2.3];

/// Joint targets over time.
pub(super) struct ArmMotion {
    waves: Sides<[Wave; ARM_JOINTS]>,
    /// True if the arms are held out. An arm that lacks joints keeps its rest pose, since the same angles
    /// would move its hand elsewhere.
    held_out: bool,
    closes: bool,
}

/// Sinusoidal swing of one joint.
#[derive(Clone, Copy)]
struct Wave {
    amplitude_rad: f32,
    rate_rad_s: f32,
    phase_rad: f32,
}

impl Wave {
    fn at(&self, time_s: f32) -> f32 {
        self.amplitude_rad * (self.rate_rad_s * time_s + self.phase_rad).sin()
    }
}

impl ArmMotion {
    pub(super) fn new(arms: Arms, model: &RobotModel, random: &mut SplitMix64) -> ArmMotion {
        let amplitude_rad = if arms == Arms::Waving { [0.1, 0.35] } else { [0.0, 0.03] };
        let mut wave = || Wave {
            amplitude_rad: random.uniform(amplitude_rad),
            rate_rad_s: random.uniform([1.0, 4.0]),
            phase_rad: random.uniform([0.0, 6.3]),
        };
        let waves = Sides::from_fn(|_| std::array::from_fn(|_| wave()));
        let whole = |first: usize| model.joints[first..first + ARM_JOINTS].iter().all(JointModel::exists);
        ArmMotion { waves, held_out: ARMS.into_iter().all(whole), closes: arms == Arms::Closing }
    }

    pub(super) fn at(&self, rest_rad: &[f32; UPPER_JOINTS], time_s: f32) -> [f32; UPPER_JOINTS] {
        let part = (time_s / RAISE_S).min(1.0);
        let mut q_rad = *rest_rad;
        for (side, waves) in self.waves.by_side() {
            for (i, wave) in waves.into_iter().enumerate() {
                let forward = FORWARD_LEFT_RAD[i] * if MIRRORED_ARM[i] { side.sign() } else { 1.0 };
                let column = ARM_COLUMNS[side] + i;
                let forward = if self.held_out { forward } else { rest_rad[column] };
                q_rad[column] += part * (forward - rest_rad[column] + wave.at(time_s));
            }
        }
        if self.closes {
            let closed = ((time_s - CLOSES_AT_S) / CLOSING_S).clamp(0.0, 1.0);
            for (side, first) in HAND_COLUMNS.by_side() {
                for (q_rad, fist_rad) in q_rad[first..].iter_mut().zip(FIST_LEFT_RAD) {
                    *q_rad += closed * (fist_rad * side.sign() - *q_rad);
                }
            }
        }
        q_rad
    }
}
