//! The Handover expert: A lifts the bottle by its lower half, B takes it by the upper half and puts it on
//! the pad.

use std::f32::consts::PI;

use tandem_sim::{Side, Vector};

use super::skills::{Commander, CylinderGrasp, hand_over, pick_up, release, stand_on};
use crate::players::PlayerError;
use crate::scoring::{A, B};

/// Grasp of the giver. The hands are one above the other on the straight part of the bottle, which is 20 cm
/// long; a hand is 9 cm wide.
const GIVER: CylinderGrasp =
    CylinderGrasp { robot: A, side: Side::Right, object: "bottle", grip: "grip_low", heading_rad: 0.0 };
const TAKER: CylinderGrasp =
    CylinderGrasp { robot: B, side: Side::Right, object: "bottle", grip: "grip_high", heading_rad: PI };

/// Place where the bottle changes hands: between the robots, above the counter.
const MEETING_M: Vector = Vector::new(0.36, -0.06, 0.92);
const LIFT_M: Vector = Vector::new(0.0, 0.0, 0.10);

/// Hands the bottle over. If a robot already holds the bottle, the steps before that are skipped.
pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    if !TAKER.holds(commander)? {
        if !GIVER.holds(commander)? {
            pick_up(commander, &GIVER, LIFT_M)?;
        }
        let bring = GIVER.carry(commander, MEETING_M)?;
        commander.perform(1.0, &[bring])?;
        hand_over(commander, &GIVER, &TAKER)?;
    } else if GIVER.holds(commander)? {
        release(commander, &GIVER)?;
    }
    let pad_m = commander.facts()?.position_m("target_pad");
    stand_on(commander, &TAKER, pad_m)
}
