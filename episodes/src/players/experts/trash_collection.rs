//! The TrashCollection expert: A bends its knees, takes the bin by the rim of its sides and holds it at the
//! end of the bench. B sweeps the bottle over the bench with the back of its left hand.

use std::f32::consts::FRAC_PI_2;

use tandem_sim::{Pose, Rotation, Side, Vector};

use super::skills::{
    CarryTeam, Commander, HandGrasp, HandMove, Hold, ParallelScript, grasp_compliantly, in_parallel,
};
use crate::players::PlayerError;
use crate::scoring::{A, B};

/// Height of the pelvis above the floor while A grasps the bin; `TALL_M` is the height while A stands and
/// holds it. The pelvis of a walking robot is below 0.68 m whatever is commanded.
const BENT_M: f32 = 0.68;
const TALL_M: f32 = 0.72;
/// Lift after which the bin's rim is a little lower than the bench's top.
const LIFT_M: f32 = 0.055;
const PACE_M_S: f32 = 0.28;
/// Offset of the left wrist from the middle of the bottle, which rolls in front of the middle of the hand's
/// back.
const BEHIND_BOTTLE_M: Vector = Vector::new(-0.12, -0.075, 0.022);
const ABOVE_M: f32 = 0.14;
/// Position at which the hand stops, short of the end of the bench; the bottle rolls on.
const END_Y_M: f32 = -0.05;
const SWEEP_M_S: f32 = 0.35;
/// Approximate distance that the bottle rolls aside on its way.
const ROLLS_ASIDE_M: f32 = 0.05;
/// Height below which an object has fallen off the bench.
const OFF_BENCH_M: f32 = 0.7;
const TRIES: u32 = 3;

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let bin = ParallelScript { robots: &[A], script: Box::new(bring_bin) };
    let hand = ParallelScript { robots: &[B], script: Box::new(hover_behind_bottle) };
    in_parallel(commander, vec![bin, hand])?;
    for _ in 0..TRIES {
        sweep(commander)?;
        let facts = commander.facts()?;
        if facts.inside_box("pet_bottle", "bin", "inside") {
            return Ok(());
        }
        // No robot reaches for an object on the floor.
        if facts.position_m("pet_bottle").z < OFF_BENCH_M {
            break;
        }
        hover_behind_bottle(commander)?;
    }
    Err(PlayerError::GaveUp("the bottle did not fall into the bin".into()))
}

/// Takes the bin to the end of the bench, in front of the bottle's position across the bench; A's script.
fn bring_bin(commander: &mut Commander) -> Result<(), PlayerError> {
    let grasps = HandGrasp::with_both_hands(A, "bin", ["left", "right"], -FRAC_PI_2, &Hold::WALL);
    let mut team = CarryTeam::new(commander, &grasps)?;
    commander.set_height(A, BENT_M);
    team.gather(commander)?;
    grasp_compliantly(commander, &grasps)?;
    team.lift(commander, LIFT_M)?;
    commander.set_height(A, TALL_M);
    let facts = commander.facts()?;
    let point_m = facts.position_m("carry_point");
    let end_m = Vector::new(facts.position_m("pet_bottle").x + ROLLS_ASIDE_M, point_m.y, point_m.z);
    team.carry_to(commander, &Pose::from_translation(end_m), PACE_M_S)
}

/// Brings the hand over the place behind the bottle, wherever the bottle is on the bench. A hand that waits
/// beside the bottle touches it, and the bottle rolls away.
fn hover_behind_bottle(commander: &mut Commander) -> Result<(), PlayerError> {
    let behind_m = commander.facts()?.position_m("pet_bottle") + BEHIND_BOTTLE_M;
    commander.perform(1.2, &[reach(behind_m + Vector::Z * ABOVE_M)])
}

/// Lowers the hand behind the bottle, and sweeps the bottle to the end of the bench.
fn sweep(commander: &mut Commander) -> Result<(), PlayerError> {
    let behind_m = commander.facts()?.position_m("pet_bottle") + BEHIND_BOTTLE_M;
    commander.perform(0.7, &[reach(behind_m)])?;
    let end_m = Vector::new(behind_m.x, END_Y_M, behind_m.z);
    commander.glide((end_m.y - behind_m.y).max(0.1) / SWEEP_M_S, &[reach(end_m)])?;
    commander.perform(1.0, &[reach(end_m)])
}

fn reach(wrist_m: Vector) -> HandMove {
    HandMove::reach(B, Side::Left, Pose::from_parts(wrist_m, Rotation::IDENTITY))
}
