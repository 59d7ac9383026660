//! Variation of episodes beyond the benchmark, for training data: the spread of the randomisation, the
//! variety of an expert's demonstrations, and slow noise on the robots' commands.

use serde::{Deserialize, Serialize};
use tandem_sim::{
    ARM_JOINTS, BaseCommand, BaseLimits, HAND_JOINTS, RobotCommand, RobotModel, SplitMix64, UPPER,
    UPPER_JOINTS, WAIST_COLUMN,
};

use crate::tasks::Spread;

/// Variation of an episode beyond the benchmark; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Variation {
    /// Spread of the randomisation.
    #[serde(default)]
    pub spread: Spread,
    /// Variety of an expert's demonstrations in pace, pauses and paths: from 0 for none to
    /// [`Variation::MAX_VARIETY`].
    #[serde(default)]
    pub variety: u8,
    /// Level of the slow noise added to the robots' commands. At 1 it is 0.016 rad on arm joints.
    #[serde(default)]
    pub disturb: f32,
}

impl Variation {
    pub const MAX_VARIETY: u8 = 3;
    /// Maximum of `disturb`, well above the level at which experts fail in most episodes.
    pub const MAX_DISTURB: f32 = 5.0;

    pub(crate) fn is_benchmarks(&self) -> bool {
        *self == Variation::default()
    }

    /// Lists the departures from the benchmark, each as results name it.
    pub(crate) fn departures(&self) -> impl Iterator<Item = String> {
        // The pattern has no `..`, so the compiler reports every new field.
        let Variation { spread, variety, disturb } = *self;
        let departures = [
            (spread != Spread::default()).then(|| format!("spread: {}", spread.name())),
            (variety > 0).then(|| format!("variety: {variety}")),
            (disturb > 0.0).then(|| format!("disturbed: {disturb}")),
        ];
        departures.into_iter().flatten()
    }
}

/// Number of cosines in one noise signal.
const WAVES: usize = 12;
/// Maximum frequency; above it, the noise would shake rather than drift.
const FASTEST_RAD_S: f64 = 12.0;
/// Minimum commanded speeds for noise on the base; below both of them the robot stands, and gets no noise.
const WALKS_M_S: f32 = 0.02;
const WALKS_RAD_S: f32 = 0.02;
/// Separates this random stream from the one that moves objects under the same seed.
const STREAM: u64 = 0x6469_7374_7572_6265;

/// Standard deviation and correlation time of the noise on one kind of number, at level 1.
#[derive(Clone, Copy)]
struct NoiseKind {
    deviation: f32,
    time_s: f64,
}

const ARM: NoiseKind = NoiseKind { deviation: 0.016, time_s: 0.5 };
const WAIST: NoiseKind = NoiseKind { deviation: 0.008, time_s: 0.5 };
const WALK: NoiseKind = NoiseKind { deviation: 0.03, time_s: 1.0 };
const TURN: NoiseKind = NoiseKind { deviation: 0.06, time_s: 1.0 };

/// Slow noise on the commands of one episode's robots. It is a function of seed and time alone, so that a
/// replay or a continuation from a checkpoint has the same noise.
#[derive(Clone, Debug)]
pub struct Disturbance {
    robots: Vec<RobotNoise>,
}

/// Noise on one robot's commands.
#[derive(Clone, Debug)]
struct RobotNoise {
    /// Noise on the upper joints in action order; none on fingers, which would slip.
    upper: Vec<Option<SlowNoise>>,
    /// Noise on the forward and leftward speed and on the yaw rate.
    base: [SlowNoise; 3],
}

/// A stationary process with exponentially decaying correlation, as a sum of cosines of random frequencies
/// (Rahimi and Recht, 2007). The frequencies of the exponential kernel are Cauchy-distributed.
#[derive(Clone, Debug)]
struct SlowNoise {
    deviation: f32,
    /// Frequency in rad/s, and phase.
    waves: [[f64; 2]; WAVES],
}

impl Disturbance {
    /// Returns the noise of an episode under `seed`; `None` for an undisturbed one. The strength is drawn for
    /// each episode: `level` in 50 %, half of it in 30 %, and 0 in 20 %, which show undisturbed motion.
    pub fn new(level: f32, seed: u32, robots: usize) -> Option<Disturbance> {
        let mut random = SplitMix64(u64::from(seed) ^ STREAM);
        let strength = match random.uniform([0.0, 1.0]) {
            ..0.2 => 0.0,
            ..0.5 => 0.5,
            _ => 1.0,
        };
        let scale = level * strength;
        let mut robot = || RobotNoise::new(scale, &mut random);
        (scale > 0.0).then(|| Disturbance { robots: (0..robots).map(|_| robot()).collect() })
    }

    /// Returns the command that robot number `robot` executes at `time_s`, which replaces `told`.
    pub fn executed(
        &self,
        robot: usize,
        time_s: f64,
        told: &RobotCommand,
        model: &RobotModel,
        limits: &BaseLimits,
    ) -> RobotCommand {
        let noise = &self.robots[robot];
        let mut executed = *told;
        for (column, noise) in noise.upper.iter().enumerate() {
            if let Some(noise) = noise {
                let joint = &model.joints[UPPER[column]];
                let target_rad = told.upper_rad[column] + noise.at(time_s);
                executed.upper_rad[column] = target_rad.clamp(joint.lower_rad, joint.upper_rad);
            }
        }
        let BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, .. } = told.base;
        if vx_m_s.abs() + vy_m_s.abs() >= WALKS_M_S || yaw_rate_rad_s.abs() >= WALKS_RAD_S {
            let [ahead, left, turn] = &noise.base;
            executed.base = limits.clamp(BaseCommand {
                vx_m_s: vx_m_s + ahead.at(time_s),
                vy_m_s: vy_m_s + left.at(time_s),
                yaw_rate_rad_s: yaw_rate_rad_s + turn.at(time_s),
                ..told.base
            });
        }
        executed
    }
}

impl RobotNoise {
    fn new(level: f32, random: &mut SplitMix64) -> RobotNoise {
        let mut noise = |kind: NoiseKind| SlowNoise::new(kind, level, random);
        let arms = 2 * ARM_JOINTS;
        let fingers = arms..arms + 2 * HAND_JOINTS;
        let upper = (0..UPPER_JOINTS).map(|column| match column {
            WAIST_COLUMN.. => Some(noise(WAIST)),
            column if fingers.contains(&column) => None,
            _ => Some(noise(ARM)),
        });
        RobotNoise { upper: upper.collect(), base: [WALK, WALK, TURN].map(&mut noise) }
    }
}

impl SlowNoise {
    fn new(kind: NoiseKind, level: f32, random: &mut SplitMix64) -> SlowNoise {
        let mut wave = || {
            let [place, phase] = [random.uniform([-0.5, 0.5]), random.uniform([0.0, 1.0])].map(f64::from);
            let frequency_rad_s = (std::f64::consts::PI * place).tan() / kind.time_s;
            [frequency_rad_s.clamp(-FASTEST_RAD_S, FASTEST_RAD_S), std::f64::consts::TAU * phase]
        };
        SlowNoise { deviation: kind.deviation * level, waves: std::array::from_fn(|_| wave()) }
    }

    fn at(&self, time_s: f64) -> f32 {
        let sum: f64 = self.waves.iter().map(|[rad_s, phase]| (rad_s * time_s + phase).cos()).sum();
        self.deviation * (sum * (2.0 / WAVES as f64).sqrt()) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_as_large_and_as_slow_as_it_is_said_to_be_and_the_same_again() {
        let noises: Vec<SlowNoise> =
            (0..600).map(|seed| SlowNoise::new(ARM, 1.0, &mut SplitMix64(seed))).collect();
        let mean = |of: &dyn Fn(&SlowNoise) -> f32| noises.iter().map(of).sum::<f32>() / noises.len() as f32;
        let variance = mean(&|noise| noise.at(3.0).powi(2));
        assert!((variance.sqrt() - ARM.deviation).abs() < 0.1 * ARM.deviation, "{variance}");
        // After the correlation time 1/e remains, or slightly more, since the highest frequencies are
        // clamped.
        let later = mean(&|noise| noise.at(3.0) * noise.at(3.0 + ARM.time_s)) / variance;
        assert!((0.25..0.5).contains(&later), "{later}");
        // In a control step a joint's target moves by much less than the amplitude of the noise.
        let step = mean(&|noise| (noise.at(3.02) - noise.at(3.0)).powi(2)).sqrt();
        assert!(step < 0.25 * ARM.deviation, "{step}");
        let again = SlowNoise::new(ARM, 1.0, &mut SplitMix64(17));
        assert_eq!(again.at(1.5).to_bits(), noises[17].at(1.5).to_bits());
    }

    #[test]
    fn strength_is_drawn_for_each_episode_and_a_level_of_none_is_none() {
        let of = |level: f32| (2000..3000).filter_map(move |seed| Disturbance::new(level, seed, 1));
        assert_eq!(of(0.0).count(), 0);
        let strengths: Vec<f32> = of(2.0).map(|noise| noise.robots[0].base[0].deviation).collect();
        let whole = strengths.iter().filter(|deviation| **deviation == 2.0 * WALK.deviation).count();
        let half = strengths.iter().filter(|deviation| **deviation == WALK.deviation).count();
        assert_eq!(whole + half, strengths.len());
        assert!((450..550).contains(&whole) && (250..350).contains(&half), "{whole} {half}");
    }

    #[test]
    fn fingers_and_a_base_that_stands_are_left_alone_and_limits_hold() {
        let model = crate::spec::RobotFile::default().model().unwrap();
        let limits = BaseLimits {
            vx_m_s: [-0.3, 0.3],
            vy_m_s: [-0.2, 0.2],
            yaw_rate_rad_s: [-0.5, 0.5],
            pelvis_height_m: [0.5, 0.75],
        };
        let mut told = RobotCommand {
            upper_rad: UPPER.map(|joint| model.joints[joint].upper_rad),
            base: BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m: 0.7 },
        };
        let seed = (0..).find(|seed| Disturbance::new(5.0, *seed, 2).is_some()).unwrap();
        let noise = Disturbance::new(5.0, seed, 2).unwrap();
        let mut moved = [0; 2];
        for step in 0..500 {
            for (robot, moved) in moved.iter_mut().enumerate() {
                let executed = noise.executed(robot, f64::from(step) * 0.02, &told, &model, &limits);
                assert_eq!(executed.base, told.base);
                for (column, joint) in UPPER.into_iter().enumerate() {
                    let (is_rad, limit_rad) = (executed.upper_rad[column], model.joints[joint].upper_rad);
                    assert!(is_rad <= limit_rad, "{column}");
                    *moved += usize::from(is_rad < limit_rad);
                    let finger = (2 * ARM_JOINTS..WAIST_COLUMN).contains(&column);
                    assert!(!finger || is_rad == limit_rad, "{column}");
                }
            }
        }
        assert!(moved[0] > 0 && moved[1] > 0 && moved[0] != moved[1], "{moved:?}");
        told.base.vx_m_s = 0.3;
        let executed = noise.executed(0, 1.0, &told, &model, &limits);
        assert!(executed.base != told.base && executed.base.vx_m_s <= 0.3);
    }
}
