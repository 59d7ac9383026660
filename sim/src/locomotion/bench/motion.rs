//! Random numbers of a seed, and arm motion drawn from them.

use crate::robot::UPPER_JOINTS;

/// SplitMix64: the same numbers everywhere.
pub(super) struct Random(pub u64);

impl Random {
    /// Uniform in `low..high`.
    pub(super) fn uniform(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        low + (high - low) * ((z >> 40) as f32 / (1u64 << 24) as f32)
    }
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Arms {
    /// Held out with a little random motion.
    Forward,
    /// As forward, with every joint swinging widely.
    Waving,
}

/// Arm joints of the action row: left 7, right 7.
const ARM_JOINTS: usize = 14;
/// Hands a forearm's length ahead of the chest: shoulder pitch, roll, yaw, elbow, wrist.
const FORWARD_LEFT_RAD: [f32; 7] = [-0.35, 0.2, 0.0, 0.3, 0.0, 0.0, 0.0];
/// Roll and yaw joints mirror.
const MIRROR: [f32; 7] = [1.0, -1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
const RAISE_S: f32 = 1.5;

/// Joint targets over time.
pub(super) struct ArmMotion {
    /// Amplitude (rad), frequency (rad/s), phase per joint.
    waves: [[f32; 3]; ARM_JOINTS],
}

impl ArmMotion {
    pub(super) fn new(arms: Arms, random: &mut Random) -> ArmMotion {
        let amplitude = if arms == Arms::Waving { [0.1, 0.35] } else { [0.0, 0.03] };
        let waves = std::array::from_fn(|_| {
            [random.uniform(amplitude[0], amplitude[1]), random.uniform(1.0, 4.0), random.uniform(0.0, 6.3)]
        });
        ArmMotion { waves }
    }

    pub(super) fn at(&self, rest_rad: &[f32; UPPER_JOINTS], time_s: f32) -> [f32; UPPER_JOINTS] {
        let part = (time_s / RAISE_S).min(1.0);
        let mut q_rad = *rest_rad;
        for (i, [amplitude, rate, phase]) in self.waves.iter().enumerate() {
            let forward = FORWARD_LEFT_RAD[i % 7] * if i < 7 { 1.0 } else { MIRROR[i % 7] };
            q_rad[i] += part * (forward - rest_rad[i] + amplitude * (rate * time_s + phase).sin());
        }
        q_rad
    }
}
