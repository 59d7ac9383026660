//! Push stress: one of the robots is pushed at its chest once in every ten seconds. The seed draws the
//! time, the robot and the direction. The force is external, as in the bench of the base controller.

use std::f32::consts::TAU;

use tandem_sim::{PlannedPush, Vector};

use super::{StressAxis, StressLevel, random};

const FORCE_N: [f32; 3] = [20.0, 40.0, 60.0];
/// Duration of a push: half a second.
const PUSH_STEPS: u64 = 25;
/// Period of the pushes.
const EVERY_STEPS: u64 = 500;
/// Number of planned pushes. They last for an hour, more than any budget.
const PUSHES: u64 = 360;
/// Link of the robot's file that is pushed; `POINT_M` is the middle of the chest in its frame.
const LINK: &str = "torso_link";
const POINT_M: Vector = Vector::new(0.0, 0.0, 0.1);

pub fn plan(level: StressLevel, seed: u32, robots: usize, hold_steps: u32) -> Vec<PlannedPush> {
    let push = |number: u64| {
        let mut random = random(StressAxis::Push, seed, number as usize);
        let latest = (EVERY_STEPS - PUSH_STEPS) as f32;
        let from = u64::from(hold_steps) + number * EVERY_STEPS + random.uniform([0.0, latest]) as u64;
        let robot = (random.uniform([0.0, robots as f32]) as usize).min(robots - 1);
        let heading_rad = random.uniform([0.0, TAU]);
        PlannedPush {
            robot,
            link: LINK.into(),
            point_in_link_m: POINT_M,
            force_n: Vector::new(heading_rad.cos(), heading_rad.sin(), 0.0) * level.of(FORCE_N),
            control_steps: from..from + PUSH_STEPS,
        }
    };
    (0..PUSHES).map(push).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_push_the_same_robots_at_the_same_time_ever_harder() {
        let [one, two, three] = StressLevel::ALL.map(|level| plan(level, 7, 3, 300));
        for ((one, two), three) in one.iter().zip(&two).zip(&three) {
            assert_eq!((one.robot, &one.control_steps), (two.robot, &two.control_steps));
            let forces_n = [one, two, three].map(|push| push.force_n.length());
            assert!(forces_n.iter().zip(FORCE_N).all(|(found, wanted)| (found - wanted).abs() < 1e-3));
            assert!(one.control_steps.start >= 300 && one.force_n.z == 0.0);
        }
        let begins = |number: usize| (one[number].control_steps.start - 300) / EVERY_STEPS;
        assert!(
            (0..PUSHES as usize).all(|number| begins(number) == number as u64),
            "one in each ten seconds"
        );
        let robots: std::collections::BTreeSet<usize> = one.iter().map(|push| push.robot).collect();
        assert_eq!(robots.len(), 3);
    }
}
