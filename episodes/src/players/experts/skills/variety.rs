//! Variation between demonstrations of one task, similar to people's: pace, pauses, detours of the hands,
//! and hands that miss now and then and come back. Everything is drawn from the episode's seed.

use tandem_sim::{SplitMix64, Vector};

/// Range of the relative change of a motion's duration at level 1.
const PACE: [f32; 2] = [-0.08, 0.2];
/// Maximum relative reduction of the walking pace at level 1.
const SLOWER: f32 = 0.12;
/// Probability of a pause before a motion at level 1, and the range of its duration.
const PAUSES: f32 = 0.12;
const PAUSE_S: [f32; 2] = [0.1, 0.5];
/// Maximum detour of a hand from its straight line at level 1, as a share of its way; `MAX_STRAY_M` is the
/// absolute limit.
const STRAY: f32 = 0.08;
const MAX_STRAY_M: f32 = 0.02;
/// Probability at level 1 that a free hand misses after a long way, and the range of the error.
const MISSES: f32 = 0.12;
const MISS_M: [f32; 2] = [0.01, 0.03];
/// Minimum length of a long way. Every object to be grasped is farther away.
const LONG_WAY_M: f32 = 0.12;
/// Time that a hand which has missed needs to come back.
pub const COME_BACK_S: f32 = 0.5;

/// Constant that separates this random stream from the one with which the same seed places objects.
const STREAM: u64 = 0x7661_7269_6574_7931;

/// Random source of a demonstration's variation.
#[derive(Clone, Debug)]
pub struct Variety {
    level_factor: f32,
    /// State of the generator.
    random: u64,
    /// Share of the usual walking pace, constant over the episode.
    walking_pace: f32,
}

impl Variety {
    /// Creates the variety of a level; `None` for level 0, which has no variety.
    pub fn new(level: u8, seed: u32) -> Option<Variety> {
        if level == 0 {
            return None;
        }
        let mut variety =
            Variety { level_factor: level.into(), random: u64::from(seed) ^ STREAM, walking_pace: 1.0 };
        variety.walking_pace = 1.0 - variety.draw([0.0, SLOWER * variety.level_factor]);
        Some(variety)
    }

    /// Returns the variety of one of several scripts that run at the same time. Each has a separate stream,
    /// so the order of draws between scripts does not matter.
    pub fn of_script(&self, script: usize) -> Variety {
        let mut own = self.clone();
        own.random ^= (script as u64 + 1) << 40;
        own
    }

    /// Returns the share of its usual pace at which a robot walks.
    pub fn walking(&self) -> f32 {
        self.walking_pace
    }

    /// Draws the duration of a motion whose plain duration is `duration_s`.
    pub fn duration_s(&mut self, duration_s: f32) -> f32 {
        duration_s * (1.0 + self.draw(PACE.map(|limit| limit * self.level_factor)))
    }

    /// Draws the pause before a motion.
    pub fn pause_s(&mut self) -> f32 {
        let pause_s = self.draw(PAUSE_S);
        if self.happens(PAUSES) { pause_s } else { 0.0 }
    }

    /// Draws the offset of the hands from their straight line half way along `way_m`, never below it.
    pub fn stray_m(&mut self, way_m: f32) -> Vector {
        let most_m = (STRAY * way_m).min(MAX_STRAY_M) * self.level_factor;
        self.aside_m(most_m)
    }

    /// Draws the error of free hands at the end of `way_m`; `None` if they do not miss.
    pub fn miss_m(&mut self, way_m: f32) -> Option<Vector> {
        let off_m = self.draw(MISS_M);
        let aside_m = self.aside_m(off_m);
        (self.happens(MISSES) && way_m > LONG_WAY_M).then_some(aside_m)
    }

    /// Draws an offset of up to `most_m` to each side and up.
    fn aside_m(&mut self, most_m: f32) -> Vector {
        let [x, y, z] = [[-1.0, 1.0], [-1.0, 1.0], [0.0, 1.0]].map(|range| self.draw(range));
        Vector::new(x, y, z) * most_m
    }

    fn happens(&mut self, share: f32) -> bool {
        self.draw([0.0, 1.0]) < share * self.level_factor
    }

    fn draw(&mut self, [min, max]: [f32; 2]) -> f32 {
        let mut generator = SplitMix64(self.random);
        let drawn = generator.uniform([min, max]);
        self.random = generator.0;
        drawn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_always_draws_the_same_and_seeds_and_scripts_differ() {
        assert!(Variety::new(0, 7).is_none());
        let drawn = |mut variety: Variety| -> Vec<f32> {
            (0..20)
                .flat_map(|_| [variety.duration_s(1.0), variety.pause_s(), variety.stray_m(0.3).x])
                .collect()
        };
        let of = |seed: u32| Variety::new(1, seed).unwrap();
        assert_eq!(drawn(of(7)), drawn(of(7)));
        assert_ne!(drawn(of(7)), drawn(of(8)));
        assert_ne!(drawn(of(7).of_script(0)), drawn(of(7).of_script(1)));
        let times = drawn(of(9));
        assert!(times.iter().step_by(3).all(|time_s| (0.92..=1.2).contains(time_s)), "{times:?}");
        assert!(times.iter().skip(2).step_by(3).all(|stray_m| stray_m.abs() <= 0.02), "{times:?}");
    }

    #[test]
    fn a_hand_misses_on_long_ways_alone() {
        let mut variety = Variety::new(3, 2000).unwrap();
        let count =
            |variety: &mut Variety, way_m: f32| (0..500).filter(|_| variety.miss_m(way_m).is_some()).count();
        assert_eq!(count(&mut variety, 0.08), 0);
        assert!((130..230).contains(&count(&mut variety, 0.4)));
    }
}
