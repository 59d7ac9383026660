//! The SetTheTable expert: each robot takes one object after another from its sideboard, turns to the table
//! and puts the object on its place. Both work at the same time, each on its side. They begin with objects
//! below which the idle left hand is free.
//!
//! After each thing both hands return to their first poses. A hand stays where it is in the world while its
//! robot rises from a walk, and is therefore lower on the next walk. Without the return, in the second
//! round the idle hand met the edge of the table, and the robot fell.

use std::f32::consts::{FRAC_PI_2, PI};

use tandem_sim::{Pose, Side, Vector};

use crate::players::PlayerError;
use crate::players::experts::skills::{
    Commander, CylinderGrasp, HandMove, ParallelScript, Tolerance, WalkGoal, approach, at_hand, in_parallel,
    pick_up, release, upright, walk_to,
};
use crate::scoring::{A, B};

const WALK_M_S: f32 = 0.35;
/// Speed at which a robot walks with an object in its hand.
const CARRY_M_S: f32 = 0.25;
/// Lift of a held thing. While a robot walks, its pelvis and what it carries are up to 12 cm lower than at
/// rest.
const LIFT_M: Vector = Vector::new(0.0, 0.0, 0.26);
/// Distance that a robot steps back from its sideboard before it turns, and from the table before it
/// fetches the next thing.
const BACK_M: f32 = 0.30;
const OVER_PLACE_M: f32 = 0.10;
/// Height over its place at which a thing is released.
const DROP_M: f32 = 0.003;
const AT_HAND: Tolerance = Tolerance { off_m: 0.03, off_rad: 0.05 };
/// Tolerance for the waypoint on the way back, at which the robot already turns.
const ON_THE_WAY: Tolerance = Tolerance { off_m: 0.10, off_rad: 0.8 };

/// One robot's part: the headings at its sideboard and at the table, and pairs of thing and place in their
/// order.
struct Part<'a> {
    robot: usize,
    to_sideboard_rad: f32,
    to_table_rad: f32,
    things: &'a [[&'a str; 2]],
}

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let wanted = commander.task().chosen("wanted").unwrap_or_default();
    let bottle_pad = format!("{wanted}_pad");
    let of_a = Part {
        robot: A,
        to_sideboard_rad: FRAC_PI_2,
        to_table_rad: 0.0,
        things: &[["white_cup", "white_pad"], ["yellow_cup", "yellow_pad"], ["green_cup", "green_pad"]],
    };
    let of_b = Part {
        robot: B,
        to_sideboard_rad: -FRAC_PI_2,
        to_table_rad: PI,
        things: &[["violet_cup", "violet_pad"], ["bottle", &bottle_pad]],
    };
    let scripts = vec![
        ParallelScript { robots: &[A], script: Box::new(|commander| of_a.perform(commander)) },
        ParallelScript { robots: &[B], script: Box::new(|commander| of_b.perform(commander)) },
    ];
    in_parallel(commander, scripts)
}

impl Part<'_> {
    fn perform(&self, commander: &mut Commander) -> Result<(), PlayerError> {
        let at_rest = commander.facts()?.robots[self.robot].wrist_in_pelvis;
        for [thing, pad] in self.things {
            self.serve(commander, thing, pad)?;
            let world_from_pelvis = commander.facts()?.robots[self.robot].pelvis_in_world;
            let home = |side: Side| HandMove::reach(self.robot, side, world_from_pelvis * at_rest[side]);
            commander.perform(0.8, &Side::BOTH.map(home))?;
            self.step_back(commander, world_from_pelvis)?;
        }
        Ok(())
    }

    /// Takes one thing to its place and releases it there.
    fn serve(&self, commander: &mut Commander, thing: &str, pad: &str) -> Result<(), PlayerError> {
        let grasp = |heading_rad: f32| CylinderGrasp {
            robot: self.robot,
            side: Side::Right,
            object: thing,
            grip: "grip",
            heading_rad,
        };
        let standing_m = commander.facts()?.position_m(thing);
        let before = at_hand(standing_m, self.to_sideboard_rad);
        walk_to(commander, &[WalkGoal { robot: self.robot, to: before, pace_m_s: WALK_M_S }])?;
        pick_up(commander, &grasp(self.to_sideboard_rad), LIFT_M)?;
        self.step_back(commander, before)?;
        let pad_m = commander.facts()?.position_m(pad);
        let to = at_hand(pad_m, self.to_table_rad);
        approach(commander, &[WalkGoal { robot: self.robot, to, pace_m_s: CARRY_M_S }], AT_HAND)?;
        for (height_m, duration_s) in [(OVER_PLACE_M, 1.2), (DROP_M, 1.0)] {
            let over = grasp(self.to_table_rad).carry(commander, pad_m + Vector::Z * height_m)?;
            commander.perform(duration_s, &[over])?;
        }
        release(commander, &grasp(self.to_table_rad))
    }

    fn step_back(&self, commander: &mut Commander, from: Pose) -> Result<(), PlayerError> {
        let to = upright(&from) * Pose::from_translation(Vector::new(-BACK_M, 0.0, 0.0));
        approach(commander, &[WalkGoal { robot: self.robot, to, pace_m_s: CARRY_M_S }], ON_THE_WAY)
    }
}
