//! The Pouring expert: both lift their vessels, and A turns the cup about its lip above the mouth of B's
//! glass.

use std::f32::consts::PI;

use tandem_sim::{Pose, Rotation, Side, Vector};

use super::skills::{Commander, CylinderGrasp, HandMove, pick_up_all};
use crate::players::PlayerError;
use crate::scoring::{A, B};

/// Grasp of the cup. Both vessels are held by their lower part; a hand is 9 cm wide and stays clear of the
/// table.
const CUP: CylinderGrasp =
    CylinderGrasp { robot: A, side: Side::Right, object: "cup", grip: "grip", heading_rad: 0.0 };
const GLASS: CylinderGrasp =
    CylinderGrasp { robot: B, side: Side::Right, object: "glass", grip: "grip", heading_rad: PI };

/// Height above the grips at which hands move aside.
const OVER_M: f32 = 0.2;
/// Place where B holds the glass: between the robots, just above the table.
const GLASS_PLACE_M: Vector = Vector::new(0.40, 0.0, 0.86);
/// Offset of the lip above the mouth while pouring; `BEFORE_TIPPING_M` is added while the cup is upright.
const ABOVE_MOUTH_M: Vector = Vector::new(0.0, 0.0, 0.03);
const BEFORE_TIPPING_M: Vector = Vector::new(0.0, -0.04, 0.10);
const TIP_RAD: f32 = 2.0;
/// Additional tip angle if the marble stays in the cup, up to `DEEPEST_RAD`, the limit of the wrist.
const MORE_RAD: f32 = 0.2;
const DEEPEST_RAD: f32 = 2.6;
/// Number of straight moves that make up the tip.
const TIP_MOVES: u32 = 8;
const TIP_MOVE_S: f32 = 0.3;

/// Pours the marble. Vessels that are already held have been lifted.
pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    if !(CUP.holds(commander)? && GLASS.holds(commander)?) {
        lift(commander)?;
    }
    let glass = GLASS.carry(commander, GLASS_PLACE_M)?;
    let cup = cup_at(commander, Pose::from_translation(GLASS_PLACE_M), 0.0)?;
    commander.perform(1.5, &[cup, glass])?;
    pour_until_it_is_in(commander)
}

fn lift(commander: &mut Commander) -> Result<(), PlayerError> {
    // Hands begin in front of the vessels, and fingers on their way down would knock over a vessel that is
    // near.
    let over = [CUP.beside(commander, OVER_M)?, GLASS.beside(commander, OVER_M)?];
    commander.perform(0.5, &over)?;
    pick_up_all(commander, &[CUP, GLASS])?;
    let raise = |commander: &mut Commander, grasp: &CylinderGrasp, by_m: f32| {
        let from_m = commander.facts()?.position_m(grasp.object);
        grasp.carry(commander, from_m + Vector::new(0.0, 0.0, by_m))
    };
    let lifts = [raise(commander, &CUP, 0.12)?, raise(commander, &GLASS, 0.06)?];
    commander.perform(1.0, &lifts)
}

fn pour_until_it_is_in(commander: &mut Commander) -> Result<(), PlayerError> {
    let mut tip_rad = TIP_RAD;
    loop {
        pour(commander, tip_rad)?;
        for _ in 0..4 {
            commander.perform(0.5, &[GLASS.close()])?;
        }
        let facts = commander.facts()?;
        if facts.inside_vessel("marble", "glass") {
            return Ok(());
        }
        // A glass marble rolls on over worktop and floor. If it misses, it is off the worktop within two
        // seconds and ends up on the floor, where no hand reaches.
        if !facts.inside_vessel("marble", "cup") {
            return Err(PlayerError::GaveUp("the marble fell beside the glass".into()));
        }
        tip_rad = (tip_rad + MORE_RAD).min(DEEPEST_RAD);
        let upright = cup_at(commander, facts.object("glass").pose_in_world, 0.0)?;
        commander.perform(1.0, &[upright])?;
    }
}

/// Tips the cup by `tip_rad`, with its lip over the glass as the glass moves.
fn pour(commander: &mut Commander, tip_rad: f32) -> Result<(), PlayerError> {
    for part in 1..=TIP_MOVES {
        let glass = commander.facts()?.object("glass").pose_in_world;
        let tip = cup_at(commander, glass, tip_rad * part as f32 / TIP_MOVES as f32)?;
        commander.glide(TIP_MOVE_S, &[tip])?;
    }
    Ok(())
}

/// Returns the wrist motion that puts the cup, tipped by `tilt_rad`, with its lip above the mouth of the
/// glass. The cup is tipped to +y, away from the palm.
fn cup_at(commander: &mut Commander, world_from_glass: Pose, tilt_rad: f32) -> Result<HandMove, PlayerError> {
    let facts = commander.facts()?;
    let [mouth_m, lip_m] =
        [("glass", "mouth"), ("cup", "lip")].map(|(object, site)| facts.site(object, site).position_m());
    let rotation = Rotation::from_rotation_x(-tilt_rad);
    let to_go = (1.0 - tilt_rad / TIP_RAD).max(0.0);
    let goal_m = world_from_glass * mouth_m + ABOVE_MOUTH_M + BEFORE_TIPPING_M * to_go;
    CUP.bring(commander, Pose::from_parts(goal_m - rotation * lip_m, rotation))
}
