//! Sequences of control steps, and the phases that they reach.

use std::f32::consts::FRAC_PI_2;

use tandem_sim::{CONTROL_HZ, Pose, Rotation, Side::Right, Vector};

use super::*;
use crate::{
    scoring::{A, B, C, Grip::Holding},
    tasks::{self, Task},
};

/// State of the bottle in a control step of Handover: the robots that hold it, or its place.
#[derive(Clone, Copy, Debug)]
enum BottleState {
    Rests,
    Aloft(&'static [usize]),
    OnTarget,
}
use BottleState::{Aloft, OnTarget, Rests};

fn facts(state: BottleState) -> Facts {
    let mut facts = Facts::at_rest(&tasks::find("handover").unwrap());
    match state {
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

/// Returns the number of phases reached after each of the states.
fn play(states: &[BottleState]) -> Vec<usize> {
    let mut tracker = PhaseTracker::new(tasks::find("handover").unwrap().phases.clone());
    let step = |state: &BottleState| {
        tracker.update(&facts(*state));
        tracker.reached().count()
    };
    states.iter().map(step).collect()
}

#[test]
fn order_is_enforced_and_sequences_are_unbroken() {
    let (by_a, by_both, by_b, by_nobody) = (Aloft(&[A]), Aloft(&[A, B]), Aloft(&[B]), Aloft(&[]));
    for (states, reached) in [
        (&[Rests, by_a, by_both, by_b, OnTarget][..], &[0, 1, 1, 2, 3][..]),
        // The right final pose alone is not enough, nor is a transfer without A's lift.
        (&[OnTarget, OnTarget], &[0, 0]),
        (&[by_b, OnTarget], &[0, 0]),
        (&[by_a, OnTarget, by_b, OnTarget], &[1, 1, 1, 1]),
        // A throw: they never held it together.
        (&[by_a, by_nobody, by_b, OnTarget], &[1, 1, 1, 1]),
        // They held it together, dropped it, and B picked it up: they have to hold it together again.
        (&[by_a, by_both, by_nobody, by_b, OnTarget], &[1, 1, 1, 1, 1]),
        (&[by_a, by_both, by_nobody, by_b, by_both, by_b, OnTarget], &[1, 1, 1, 1, 1, 2, 3]),
        // A takes it back in between, which is no release.
        (&[by_a, by_both, by_a, by_both, by_b, OnTarget], &[1, 1, 1, 1, 2, 3]),
        // A phase that has been reached stays reached.
        (&[by_a, Rests, by_both, by_b, by_nobody, OnTarget, Rests], &[1, 1, 1, 2, 2, 3, 3]),
    ] {
        assert_eq!(play(states), reached, "{states:?}");
    }
}

/// Pouring's last phase, one step of 20 ms at a time: whether the marble is in the glass, and the height of
/// the glass.
#[test]
fn a_lasting_condition_needs_its_whole_time_without_a_break() {
    const IN: (bool, f32) = (true, 0.1);
    const OUT: (bool, f32) = (false, 0.1);
    const LOW: (bool, f32) = (true, 0.0299);
    let pouring = tasks::find("pouring").unwrap();
    let facts = |step: usize, (inside, glass_m): (bool, f32)| {
        let mut facts = Facts::at_rest(&pouring).raised("cup", 0.1).raised("glass", glass_m);
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
        // The glass has to be in the air at the end of the time, not before.
        (&[(OUT, 1), (LOW, 60)], 2),
        (&[(OUT, 1), (LOW, 60), (IN, 1)], 3),
    ] {
        let mut tracker = PhaseTracker::new(pouring.phases.clone());
        let steps = runs.iter().flat_map(|(state, count)| std::iter::repeat_n(*state, *count));
        for (step, state) in steps.enumerate() {
            tracker.update(&facts(step, state));
        }
        assert_eq!(tracker.reached().count(), expected, "{runs:?}");
    }
}

/// Returns facts with the objects of `task` in their final places, without any robot's action.
fn objects_in_place(task: &Task) -> Facts {
    let apples = ["apple_1", "apple_2", "apple_3", "apple_4", "apple_5", "apple_6"];
    let at = |x_m: f32, y_m: f32, z_m: f32| Pose::from_translation(Vector::new(x_m, y_m, z_m));
    let turned = |by_rad: f32| Pose::from_rotation(Rotation::from_rotation_z(by_rad));
    // Object, reference object, and the object's pose in the frame of the reference object.
    let moves: Vec<(&str, &str, Pose)> = match task.id.as_str() {
        "handover" => vec![("bottle", "target_pad", at(0.0, 0.0, 0.0))],
        "pouring" => vec![("marble", "glass", at(0.0, 0.0, 0.02))],
        "frame_hang" => vec![("frame", "wall_peg", at(0.0, -0.05, -0.98))],
        "co_pouring" => apples.map(|apple| (apple, "crate", at(0.0, 0.0, 0.05))).into(),
        "trash_collection" => {
            vec![("bin", "carry_point", at(0.0, 0.0, 0.12)), ("pet_bottle", "bin", at(0.0, 0.0, 0.1))]
        }
        "cart_service" => vec![("bottle", "serving_patch", at(0.0, 0.0, 0.0))],
        "co_carry" => vec![("basket", "basket_patch", at(0.0, 0.0, 0.0))],
        "table_align" => vec![("office_table", "office_chair", at(0.4, 0.0, 0.0) * turned(FRAC_PI_2))],
        "move_house" => vec![
            ("console_table", "foot_marks", at(0.0, 0.0, 0.0)),
            ("lever_door leaf", "lever_door", at(0.025, 0.475, 0.0) * turned(1.5)),
        ],
        "big_table" => vec![("round_table", "goal_disc", at(0.0, 0.0, 0.0))],
        other => panic!("say where the objects of {other} belong in the end"),
    };
    let mut facts = Facts::at_rest(task);
    for (object, to, to_from_object) in moves {
        let goal = facts.object(to).pose_in_world * to_from_object;
        facts.object_mut(object).pose_in_world = goal;
    }
    facts
}

#[test]
fn the_right_final_pose_alone_is_never_a_success() {
    for task in tasks::cohub() {
        let facts = objects_in_place(task);
        let mut tracker = PhaseTracker::new(task.phases.clone());
        for step in 0..200 {
            tracker.update(&Facts { time_s: f64::from(step) / CONTROL_HZ, ..facts.clone() });
        }
        assert_eq!(tracker.reached().count(), 0, "{}", task.id);
    }
}

/// MoveHouse's first phase, one step of 20 ms at a time: whether the table is lifted, and the door's angle.
#[test]
fn milestones_are_passed_in_any_order_and_stay_passed() {
    const NOTHING: (bool, f32) = (false, 0.0);
    const LIFTED: (bool, f32) = (true, 0.0);
    const OPEN: (bool, f32) = (false, 1.5);
    let move_house = tasks::find("move_house").unwrap();
    let facts = |step: usize, (lifted, door_rad): (bool, f32)| {
        let mut facts = Facts::at_rest(&move_house).turned("lever_door leaf", Vector::Z, door_rad);
        facts.time_s = step as f64 / CONTROL_HZ;
        if lifted {
            facts = facts.held_by(&[B, C], "console_table").raised("console_table", 0.05);
        }
        facts
    };
    // Half a second is 25 steps, from the first of 26 to the last.
    for (runs, expected) in [
        (&[(LIFTED, 1), (OPEN, 25)][..], 0),
        (&[(LIFTED, 1), (OPEN, 26)], 1),
        (&[(OPEN, 26), (NOTHING, 10), (LIFTED, 1)], 1),
        (&[(LIFTED, 1), (NOTHING, 10), (OPEN, 26)], 1),
        (&[(LIFTED, 1), (OPEN, 25), (NOTHING, 1), (OPEN, 25)], 0),
        (&[(OPEN, 60)], 0),
        (&[(LIFTED, 60)], 0),
    ] {
        let mut tracker = PhaseTracker::new(move_house.phases.clone());
        let steps = runs.iter().flat_map(|(state, count)| std::iter::repeat_n(*state, *count));
        for (step, state) in steps.enumerate() {
            tracker.update(&facts(step, state));
        }
        assert_eq!(tracker.reached().count(), expected, "{runs:?}");
    }
}

#[test]
fn each_phase_has_the_time_of_its_step() {
    let handover = tasks::find("handover").unwrap();
    let mut tracker = PhaseTracker::new(handover.phases.clone());
    for (time_s, state) in [(1.0, Rests), (2.0, Aloft(&[A])), (3.0, Aloft(&[A, B])), (4.0, Aloft(&[B]))] {
        let facts = Facts { time_s, ..facts(state) };
        assert_eq!(tracker.update(&facts), time_s == 2.0 || time_s == 4.0);
    }
    let reached: Vec<_> = tracker.reached().map(|(phase, time_s)| (phase.id.as_str(), time_s)).collect();
    assert_eq!(reached, [("grasp_and_lift", 2.0), ("transfer", 4.0)]);
    assert!(!tracker.complete());
}

#[test]
fn a_spoiled_phase_stays_out_of_reach_and_spoils_no_other() {
    fn lifted(facts: &Facts) -> bool {
        facts.lift_m("bottle") > 0.05
    }
    let spoiled: Condition = Arc::new(|facts: &Facts| facts.holds(B, Right, "bottle"));
    let phase = |done: Done| Phase {
        id: "lift".into(),
        description: "It is lifted.".into(),
        collaborative: false,
        done,
        nearness: Arc::new(|_| 0.0),
    };
    let guarded = || {
        let done = Box::new(Done::When(Arc::new(lifted)));
        phase(Done::Unless { spoiled: spoiled.clone(), done })
    };
    let reached = |phases: Vec<Phase>, states: &[BottleState]| {
        let mut tracker = PhaseTracker::new(phases.into());
        for state in states {
            tracker.update(&facts(*state));
        }
        tracker.reached().count()
    };
    assert_eq!(reached(vec![guarded()], &[Rests, Aloft(&[A])]), 1);
    assert_eq!(reached(vec![guarded()], &[Rests, Aloft(&[B]), Rests, Aloft(&[A])]), 0);
    // Actions before the phase was next do not count against it.
    let rests: Condition = Arc::new(|facts: &Facts| facts.lift_m("bottle") < 0.01);
    assert_eq!(reached(vec![phase(Done::When(rests)), guarded()], &[Aloft(&[B]), Rests, Aloft(&[A])]), 2);
}
