//! In what episodes vary beyond the benchmark, for data that learners get farther with: how far the seed moves things, how much an
//! expert's demonstrations differ from each other, and slow noise on what robots are told.

use serde::{Deserialize, Serialize};
use tandem_sim::{
    ARM_JOINTS, BaseCommand, BaseLimits, HAND_JOINTS, RobotCommand, RobotModel, SplitMix64, UPPER,
    UPPER_JOINTS, WAIST_COLUMN,
};

use crate::tasks::Spread;

/// In what episodes vary beyond the benchmark; by default in nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Variation {
    /// How far the seed moves things.
    #[serde(default)]
    pub spread: Spread,
    /// How much an expert's demonstrations differ in pace, pauses and ways: 0 for not at all, up to [`Variation::MAX_VARIETY`].
    #[serde(default)]
    pub variety: u8,
    /// How much slow noise is added to what robots are told before they do it; 1 is 0.016 rad on the joints of arms.
    #[serde(default)]
    pub disturb: f32,
}

impl Variation {
    pub const MAX_VARIETY: u8 = 3;
    /// Experts lose most episodes long before.
    pub const MAX_DISTURB: f32 = 5.0;

    pub(crate) fn is_benchmarks(&self) -> bool {
        *self == Variation::default()
    }

    /// What of it is not as the benchmark has it, each as results name it.
    pub(crate) fn departures(&self) -> impl Iterator<Item = String> {
        // Without `..`, so that the compiler asks about a new field.
        let Variation { spread, variety, disturb } = *self;
        let departures = [
            (spread != Spread::default()).then(|| format!("spread: {}", spread.name())),
            (variety > 0).then(|| format!("variety: {variety}")),
            (disturb > 0.0).then(|| format!("disturbed: {disturb}")),
        ];
        departures.into_iter().flatten()
    }
}

/// Cosines of which one noise is the sum.
const WAVES: usize = 12;
/// Faster is shaking, not drifting.
const FASTEST_RAD_S: f64 = 12.0;
/// A base that is told less stands, and is left alone.
const WALKS_M_S: f32 = 0.02;
const WALKS_RAD_S: f32 = 0.02;
/// What tells this generator's numbers from those by which the same seed moves things.
const STREAM: u64 = 0x6469_7374_7572_6265;

/// How large and how slow the noise on one kind of number is, at level 1: its deviation and its correlation time.
#[derive(Clone, Copy)]
struct NoiseKind {
    deviation: f32,
    time_s: f64,
}

const ARM: NoiseKind = NoiseKind { deviation: 0.016, time_s: 0.5 };
const WAIST: NoiseKind = NoiseKind { deviation: 0.008, time_s: 0.5 };
const WALK: NoiseKind = NoiseKind { deviation: 0.03, time_s: 1.0 };
const TURN: NoiseKind = NoiseKind { deviation: 0.06, time_s: 1.0 };

/// Slow noise on what the robots of one episode are told: a function of seed and time alone, so that an episode that is replayed, or
/// goes on from a checkpoint, has the same.
#[derive(Clone, Debug)]
pub struct Disturbance {
    robots: Vec<RobotNoise>,
}

/// The noise on one robot's commands.
#[derive(Clone, Debug)]
struct RobotNoise {
    /// On the upper joints in action order; none on fingers, which slip.
    upper: Vec<Option<SlowNoise>>,
    /// On the speeds ahead and to the left, and on turning.
    base: [SlowNoise; 3],
}

/// A stationary process whose correlation falls exponentially, as a sum of cosines of random frequencies (Rahimi and Recht, 2007): those
/// of the exponential kernel are Cauchy-distributed.
#[derive(Clone, Debug)]
struct SlowNoise {
    deviation: f32,
    /// Frequency, rad/s, and phase.
    waves: [[f64; 2]; WAVES],
}

impl Disturbance {
    /// The noise of an episode under `seed`; `None` where nothing is disturbed. How strong it is at most is drawn for each episode: the
    /// whole of `level` in half of them, half of it in three of ten, nothing in two of ten, which show how it goes undisturbed.
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

    /// What robot number `robot` does at `time_s` that is told `told`.
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
        // After the correlation time 1/e is left, a bit more where the fastest are slowed down.
        let later = mean(&|noise| noise.at(3.0) * noise.at(3.0 + ARM.time_s)) / variance;
        assert!((0.25..0.5).contains(&later), "{later}");
        // A control step moves a joint's target by far less than the noise is large.
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
