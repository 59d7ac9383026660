//! Mass stress: objects are heavier or lighter than in their files; the seed decides for each.

use tandem_sim::World;

use super::{StressAxis, StressLevel, random};
use crate::tasks::Task;

/// Factor by which an object is heavier, or lighter.
const TIMES: [f64; 3] = [1.25, 1.5, 2.0];

pub fn alter(world: &mut World, task: &Task, level: StressLevel, seed: u32) {
    for (index, spot) in task.objects.iter().enumerate() {
        world.scale_mass(&spot.name, times(level, seed, index));
    }
}

/// Returns the factor on the mass of the object with this number.
fn times(level: StressLevel, seed: u32, object: usize) -> f64 {
    let heavier = random(StressAxis::Mass, seed, object).uniform([0.0, 1.0]) < 0.5;
    let times = level.of(TIMES);
    if heavier { times } else { 1.0 / times }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_higher_level_is_the_same_farther_and_seeds_and_objects_differ() {
        for seed in 0..50 {
            for object in 0..4 {
                let logs = StressLevel::ALL.map(|level| times(level, seed, object).ln());
                assert!(logs.map(f64::abs).is_sorted_by(|a, b| a < b), "{logs:?}");
                assert!(logs.iter().all(|log| log.signum() == logs[0].signum()), "{logs:?}");
            }
        }
        let heavier = (0..400).filter(|seed| times(StressLevel::One, *seed, 0) > 1.0).count();
        assert!((150..250).contains(&heavier), "{heavier} of 400");
    }
}
