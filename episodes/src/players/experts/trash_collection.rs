//! TrashCollection: A bends its knees, takes the bin by its handles and holds it at the end of the bench, over which B
//! sweeps the bottle with the back of its left hand.

use std::f32::consts::FRAC_PI_2;

use tandem_sim::{Pose, Rotation, Side, Vector};

use super::skills::{CarryTeam, Commander, HandGrasp, HandMove, Hold, grasp_compliantly};
use crate::players::PlayerError;
use crate::scoring::{A, B};

const BENT_M: f32 = 0.62;
const TALL_M: f32 = 0.72;
/// The rim of the bin is then a little lower than the bench's top.
const LIFT_M: f32 = 0.055;
const PACE_M_S: f32 = 0.28;
/// Where the left wrist is from the middle of the bottle: the bottle rolls before the middle of the hand's back.
const BEHIND_BOTTLE_M: Vector = Vector::new(-0.12, -0.075, 0.022);
const ABOVE_M: f32 = 0.14;
/// The hand stops here, short of the end of the bench; the bottle rolls on.
const END_Y_M: f32 = -0.05;
const SWEEP_M_S: f32 = 0.35;
const TRIES: u32 = 3;

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let grasps = HandGrasp::with_both_hands(
        A,
        "bin",
        ["left", "right"],
        -FRAC_PI_2,
        &Hold { turned_rad: [0.0; 3], ..Hold::BAR },
    );
    let mut team = CarryTeam::new(commander, &grasps)?;
    commander.set_height(A, BENT_M);
    team.gather(commander)?;
    grasp_compliantly(commander, &grasps)?;
    team.lift(commander, LIFT_M)?;
    commander.set_height(A, TALL_M);
    let facts = commander.facts()?;
    let point_m = facts.position_m("carry_point");
    // Before the bottle, wherever that lies across the bench.
    let end_m = Vector::new(facts.position_m("pet_bottle").x, point_m.y, point_m.z);
    team.carry_to(commander, &Pose::from_translation(end_m), PACE_M_S)?;
    for _ in 0..TRIES {
        sweep(commander)?;
    }
    Err(PlayerError::GaveUp("the bottle did not fall into the bin".into()))
}

/// Puts the hand down behind the bottle, wherever that is on the bench, and sweeps it to the end.
fn sweep(commander: &mut Commander) -> Result<(), PlayerError> {
    let behind_m = commander.facts()?.position_m("pet_bottle") + BEHIND_BOTTLE_M;
    let reach = |at_m: Vector| HandMove::reach(B, Side::Left, Pose::from_parts(at_m, Rotation::IDENTITY));
    commander.perform(1.2, &[reach(behind_m + Vector::Z * ABOVE_M)])?;
    commander.perform(0.7, &[reach(behind_m)])?;
    let end_m = Vector::new(behind_m.x, END_Y_M, behind_m.z);
    commander.glide((end_m.y - behind_m.y).max(0.1) / SWEEP_M_S, &[reach(end_m)])?;
    commander.perform(1.0, &[reach(end_m)])
}
