//! Handover: A lifts the bottle by its lower half, B takes it by the upper half and puts it on the pad.

use std::f32::consts::PI;

use tandem_sim::{Side, Vector};

use super::skills::{Commander, CylinderGrasp, pick_up_all};
use crate::players::PlayerError;
use crate::scoring::{A, B};

/// One hand above the other on the straight part of the bottle, 20 cm long; a hand is 9 cm wide.
const GIVER: CylinderGrasp =
    CylinderGrasp { robot: A, side: Side::Right, object: "bottle", grip: "grip_low", heading_rad: 0.0 };
const TAKER: CylinderGrasp =
    CylinderGrasp { robot: B, side: Side::Right, object: "bottle", grip: "grip_high", heading_rad: PI };

/// Where the bottle changes hands: between the robots, above the counter.
const MEETING_M: Vector = Vector::new(0.36, -0.06, 0.92);
const LIFT_M: Vector = Vector::new(0.0, 0.0, 0.10);
/// How far above the pad the bottle is let down from.
const ABOVE_PAD_M: Vector = Vector::new(0.0, 0.0, 0.05);
const ATTEMPTS: usize = 4;

/// Whoever has the bottle already has done what comes before.
pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    if !TAKER.holds(commander)? {
        if !GIVER.holds(commander)? {
            pick_up(commander)?;
        }
        let bring = GIVER.carry(commander, MEETING_M)?;
        commander.perform(1.0, &[bring])?;
        hand_over(commander)?;
    } else if GIVER.holds(commander)? {
        release(commander, &GIVER)?;
    }
    put_down(commander)
}

fn pick_up(commander: &mut Commander) -> Result<(), PlayerError> {
    for _ in 0..ATTEMPTS {
        pick_up_all(commander, &[GIVER])?;
        let resting_m = commander.facts()?.position_m(GIVER.object);
        let lift = GIVER.carry(commander, resting_m + LIFT_M)?;
        commander.perform(1.0, &[lift])?;
        if GIVER.holds(commander)? {
            return Ok(());
        }
        release(commander, &GIVER)?;
    }
    Err(PlayerError::GaveUp("A lost the bottle".into()))
}

fn hand_over(commander: &mut Commander) -> Result<(), PlayerError> {
    for _ in 0..ATTEMPTS {
        let beside = TAKER.beside(commander, 0.0)?;
        commander.perform(1.2, &[beside])?;
        let around = TAKER.around(commander)?;
        commander.perform(0.8, &[around])?;
        commander.perform(0.8, &[TAKER.close()])?;
        commander.perform(0.2, &[TAKER.close()])?;
        if TAKER.holds(commander)? {
            return release(commander, &GIVER);
        }
        release(commander, &TAKER)?;
    }
    Err(PlayerError::GaveUp("B could not take the bottle".into()))
}

fn put_down(commander: &mut Commander) -> Result<(), PlayerError> {
    let pad_m = commander.facts()?.position_m("target_pad");
    let over = TAKER.carry(commander, pad_m + ABOVE_PAD_M)?;
    commander.perform(1.0, &[over])?;
    let down = TAKER.carry(commander, pad_m)?;
    commander.perform(0.8, &[down])?;
    release(commander, &TAKER)?;
    // The bottle has to have stood released for a moment.
    commander.perform(1.0, &[TAKER.open()])
}

fn release(commander: &mut Commander, grasp: &CylinderGrasp) -> Result<(), PlayerError> {
    commander.perform(0.5, &[grasp.open()])?;
    let away = grasp.away(commander)?;
    commander.perform(0.6, &[away])
}
