//! Handover: A lifts the bottle by its lower half, B takes it by the upper half and puts it on the pad.

use std::f32::consts::PI;

use tandem_sim::{Side, Vector};

use super::skills::{CylinderGrasp, Stage, pick_up_all};
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
pub fn perform(stage: &mut Stage) -> Result<(), PlayerError> {
    if !TAKER.holds(stage)? {
        if !GIVER.holds(stage)? {
            pick_up(stage)?;
        }
        let bring = GIVER.carry(stage, MEETING_M)?;
        stage.perform(1.0, &[bring])?;
        hand_over(stage)?;
    } else if GIVER.holds(stage)? {
        release(stage, &GIVER)?;
    }
    put_down(stage)
}

fn pick_up(stage: &mut Stage) -> Result<(), PlayerError> {
    for _ in 0..ATTEMPTS {
        pick_up_all(stage, &[GIVER])?;
        let resting_m = stage.facts()?.position_m(GIVER.object);
        let lift = GIVER.carry(stage, resting_m + LIFT_M)?;
        stage.perform(1.0, &[lift])?;
        if GIVER.holds(stage)? {
            return Ok(());
        }
        release(stage, &GIVER)?;
    }
    Err(PlayerError::GaveUp("A lost the bottle".into()))
}

fn hand_over(stage: &mut Stage) -> Result<(), PlayerError> {
    for _ in 0..ATTEMPTS {
        let beside = TAKER.beside(stage, 0.0)?;
        stage.perform(1.2, &[beside])?;
        let around = TAKER.around(stage)?;
        stage.perform(0.8, &[around])?;
        stage.perform(0.8, &[TAKER.close()])?;
        stage.perform(0.2, &[TAKER.close()])?;
        if TAKER.holds(stage)? {
            return release(stage, &GIVER);
        }
        release(stage, &TAKER)?;
    }
    Err(PlayerError::GaveUp("B could not take the bottle".into()))
}

fn put_down(stage: &mut Stage) -> Result<(), PlayerError> {
    let pad_m = stage.facts()?.position_m("target_pad");
    let over = TAKER.carry(stage, pad_m + ABOVE_PAD_M)?;
    stage.perform(1.0, &[over])?;
    let down = TAKER.carry(stage, pad_m)?;
    stage.perform(0.8, &[down])?;
    release(stage, &TAKER)?;
    // The bottle has to have stood released for a moment.
    stage.perform(1.0, &[TAKER.open()])
}

fn release(stage: &mut Stage, grasp: &CylinderGrasp) -> Result<(), PlayerError> {
    stage.perform(0.5, &[grasp.open()])?;
    let away = grasp.away(stage)?;
    stage.perform(0.6, &[away])
}
