//! Sequences of control steps, and the phases that they reach.

use tandem_sim::{CONTROL_HZ, Side::Right, Vector};

use super::*;
use crate::{
    scoring::{A, B, Grip::Holding},
    tasks::{self, Task},
};

/// What a control step of Handover shows: who holds the bottle, and where it is.
#[derive(Clone, Copy, Debug)]
enum Scene {
    Rests,
    Aloft(&'static [usize]),
    OnTarget,
}
use Scene::{Aloft, OnTarget, Rests};

fn facts(scene: Scene) -> Facts {
    let mut facts = Facts::at_rest(tasks::find("handover").unwrap());
    match scene {
        Rests => {}
        Aloft(holders) => {
            facts = facts.raised("bottle", 0.1);
            for robot in holders {
                facts = facts.grip(*robot, Right, "bottle", Holding);
            }
        }
        OnTarget => {
            let target = facts.object("target_pad").pose_in_world;
            facts.object_mut("bottle").pose_in_world = target;
        }
    }
    facts
}

/// Phases reached after each of the scenes.
fn play(scenes: &[Scene]) -> Vec<usize> {
    let mut tracker = PhaseTracker::new(tasks::find("handover").unwrap().phases);
    let step = |scene: &Scene| {
        tracker.update(&facts(*scene));
        tracker.reached().count()
    };
    scenes.iter().map(step).collect()
}

#[test]
fn order_is_enforced_and_sequences_are_unbroken() {
    let (by_a, by_both, by_b, by_nobody) = (Aloft(&[A]), Aloft(&[A, B]), Aloft(&[B]), Aloft(&[]));
    for (scenes, reached) in [
        (&[Rests, by_a, by_both, by_b, OnTarget][..], &[0, 1, 1, 2, 3][..]),
        // The right final pose alone is nothing, nor is a transfer without A's lift.
        (&[OnTarget, OnTarget], &[0, 0]),
        (&[by_b, OnTarget], &[0, 0]),
        (&[by_a, OnTarget, by_b, OnTarget], &[1, 1, 1, 1]),
        // A throw: they never held it together.
        (&[by_a, by_nobody, by_b, OnTarget], &[1, 1, 1, 1]),
        // They held it together, dropped it, and B picked it up: together again is asked for.
        (&[by_a, by_both, by_nobody, by_b, OnTarget], &[1, 1, 1, 1, 1]),
        (&[by_a, by_both, by_nobody, by_b, by_both, by_b, OnTarget], &[1, 1, 1, 1, 1, 2, 3]),
        // A takes it back in between, which is no release.
        (&[by_a, by_both, by_a, by_both, by_b, OnTarget], &[1, 1, 1, 1, 2, 3]),
        // What has been reached stays reached.
        (&[by_a, Rests, by_both, by_b, by_nobody, OnTarget, Rests], &[1, 1, 1, 2, 2, 3, 3]),
    ] {
        assert_eq!(play(scenes), reached, "{scenes:?}");
    }
}

/// Pouring's last phase, one step of 20 ms at a time: whether the marble is in the glass, and how high the glass is.
#[test]
fn a_lasting_condition_needs_its_whole_time_without_a_break() {
    const IN: (bool, f32) = (true, 0.1);
    const OUT: (bool, f32) = (false, 0.1);
    const LOW: (bool, f32) = (true, 0.0299);
    let pouring = tasks::find("pouring").unwrap();
    let facts = |step: usize, (inside, glass_m): (bool, f32)| {
        let mut facts = Facts::at_rest(pouring).raised("cup", 0.1).raised("glass", glass_m);
        facts.time_s = step as f64 / CONTROL_HZ;
        facts = facts.grip(A, Right, "cup", Holding).turned("cup", Vector::X, 1.5);
        let inside_m = facts.point_m("glass", Vector::new(0.0, 0.0, 0.02));
        if inside {
            facts.object_mut("marble").pose_in_world.translation = inside_m;
        }
        facts
    };
    // Step 0 reaches the first two phases; then runs of equal steps.
    for (runs, expected) in [
        (&[(OUT, 1), (IN, 25)][..], 2),
        (&[(OUT, 1), (IN, 26)], 3),
        (&[(OUT, 1), (IN, 25), (OUT, 1), (IN, 25)], 2),
        (&[(OUT, 1), (IN, 25), (OUT, 1), (IN, 26)], 3),
        // The glass has to be aloft when the time is over, not before.
        (&[(OUT, 1), (LOW, 60)], 2),
        (&[(OUT, 1), (LOW, 60), (IN, 1)], 3),
    ] {
        let mut tracker = PhaseTracker::new(pouring.phases);
        let steps = runs.iter().flat_map(|(scene, count)| std::iter::repeat_n(*scene, *count));
        for (step, scene) in steps.enumerate() {
            tracker.update(&facts(step, scene));
        }
        assert_eq!(tracker.reached().count(), expected, "{runs:?}");
    }
}

/// Objects of `task` where they belong in the end, put there by nobody.
fn objects_in_place(task: &'static Task) -> Facts {
    let apples = ["apple_1", "apple_2", "apple_3", "apple_4", "apple_5", "apple_6"];
    let moves: Vec<(&str, &str, Vector)> = match task.id {
        "handover" => vec![("bottle", "target_pad", Vector::ZERO)],
        "pouring" => vec![("marble", "glass", Vector::new(0.0, 0.0, 0.02))],
        "frame_hang" => vec![("frame", "wall_peg", Vector::new(0.0, -0.05, -0.98))],
        "co_pouring" => apples.map(|apple| (apple, "crate", Vector::new(0.0, 0.0, 0.05))).into(),
        other => panic!("say where the objects of {other} belong in the end"),
    };
    let mut facts = Facts::at_rest(task);
    for (object, to, offset_m) in moves {
        let goal_m = facts.point_m(to, offset_m);
        facts.object_mut(object).pose_in_world.translation = goal_m;
    }
    facts
}

#[test]
fn the_right_final_pose_alone_is_never_a_success() {
    for task in tasks::ALL {
        let facts = objects_in_place(task);
        let mut tracker = PhaseTracker::new(task.phases);
        for step in 0..200 {
            tracker.update(&Facts { time_s: f64::from(step) / CONTROL_HZ, ..facts.clone() });
        }
        assert_eq!(tracker.reached().count(), 0, "{}", task.id);
    }
}

#[test]
fn each_phase_has_the_time_of_its_step() {
    let handover = tasks::find("handover").unwrap();
    let mut tracker = PhaseTracker::new(handover.phases);
    for (time_s, scene) in [(1.0, Rests), (2.0, Aloft(&[A])), (3.0, Aloft(&[A, B])), (4.0, Aloft(&[B]))] {
        let facts = Facts { time_s, ..facts(scene) };
        assert_eq!(tracker.update(&facts), time_s == 2.0 || time_s == 4.0);
    }
    let reached: Vec<_> = tracker.reached().map(|(phase, time_s)| (phase.id, time_s)).collect();
    assert_eq!(reached, [("grasp_and_lift", 2.0), ("transfer", 4.0)]);
    assert!(!tracker.complete());
}
