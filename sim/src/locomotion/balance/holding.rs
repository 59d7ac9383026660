//! What holds a robot that is turned by force: hands that are pulled sideways turn it about the vertical, with up to 10 N m for 15 N
//! at each, and a foot that stands alone holds little more.
//!
//! Feet that stand staggered help. With the foot of one side ahead by d, half a width w from the middle, the ground pushes forward
//! under one foot and back under the other, which turns by  m g / h  d w / 2  in the mean.

use serde::{Deserialize, Serialize};

/// What lasts is held, and not what arms in motion seem to feel.
const MEAN_TIME_S: f32 = 0.5;
const DEAD_ZONE_N_M: f32 = 1.0;
/// Tuned on pulled robots, seeds 2000-2039: with more stagger one that walks sideways is slow.
const STAGGER_M_PER_N_M: f32 = 0.03;
const LARGEST_STAGGER_M: f32 = 0.12;

/// Mean moment about the vertical with which the ground has to hold the robot.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct Holding {
    moment_n_m: f32,
}

impl Holding {
    /// One physics step in which what pulls the hands turns the robot by `pulled_n_m`.
    pub(super) fn update(&mut self, pulled_n_m: f32, dt_s: f32) {
        self.moment_n_m -= (pulled_n_m + self.moment_n_m) * (dt_s / MEAN_TIME_S);
    }

    pub(super) fn moment_n_m(&self) -> f32 {
        self.moment_n_m
    }

    /// How far the left foot should be ahead of the right one.
    pub(super) fn left_ahead_m(&self) -> f32 {
        let lasting_n_m = self.moment_n_m - self.moment_n_m.clamp(-DEAD_ZONE_N_M, DEAD_ZONE_N_M);
        (STAGGER_M_PER_N_M * lasting_n_m).clamp(-LARGEST_STAGGER_M, LARGEST_STAGGER_M)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A load to the left is held to the right: the right foot goes ahead. What is small or soon over moves no foot.
    #[test]
    fn feet_are_staggered_against_what_lasts() {
        let after = |load_n_m: f32, steps: usize| {
            let mut holding = Holding::default();
            (0..steps).for_each(|_| holding.update(load_n_m, 1.0 / 200.0));
            holding.left_ahead_m()
        };
        assert_eq!(after(-0.9, 2000), 0.0);
        assert!(after(-4.0, 5) == 0.0 && after(-2.0, 2000) > 0.02 && after(2.0, 2000) < -0.02);
        assert_eq!(after(-50.0, 2000), LARGEST_STAGGER_M);
    }
}
