//! The WhichOne expert: B fetches the wanted bottle from its shelf and holds it out through the hatch. A
//! takes it by the upper half and puts it on the pad.

use std::f32::consts::{FRAC_PI_2, PI};

use tandem_sim::{Side, Vector};

use crate::players::PlayerError;
use crate::players::experts::skills::{
    Commander, CylinderGrasp, Tolerance, WalkGoal, approach, at_hand, hand_over, pick_up, place, stand_on,
    walk_to,
};
use crate::scoring::{A, B};

const WALK_M_S: f32 = 0.35;
/// Speed at which B walks with the bottle in its hand.
const CARRY_M_S: f32 = 0.25;
/// Lift of the bottle. While B walks, its pelvis and the bottle are up to 12 cm lower than at rest. The
/// bottle still has to clear the counter.
const LIFT_M: Vector = Vector::new(0.0, 0.0, 0.26);
/// Step that B takes back from the shelf before it turns. With a shorter step, its left hand would sweep over
/// the other bottles.
const BACK_M: Vector = Vector::new(0.0, -0.22, 0.0);
/// Place where B turns, clear of the wall beside the hatch. `AT_HATCH_M` is where it then stands.
const TURNING_M: Vector = Vector::new(1.02, -0.25, 0.0);
const AT_HATCH_M: Vector = Vector::new(0.74, -0.12, 0.0);
const AT_HAND: Tolerance = Tolerance { off_m: 0.03, off_rad: 0.05 };
/// Tolerance for the waypoints on the way back, at which B already turns.
const ON_THE_WAY: Tolerance = Tolerance { off_m: 0.10, off_rad: 0.5 };
/// Place where the bottle changes hands: in the hatch, above its counter.
const MEETING_M: Vector = Vector::new(0.36, -0.06, 0.92);

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let wanted = commander.task().chosen("wanted").unwrap_or_default();
    let bottle = format!("{wanted}_bottle");
    let giver = |heading_rad: f32| CylinderGrasp {
        robot: B,
        side: Side::Right,
        object: &bottle,
        grip: "grip_low",
        heading_rad,
    };
    let taker =
        CylinderGrasp { robot: A, side: Side::Right, object: &bottle, grip: "grip_high", heading_rad: 0.0 };
    let bottle_m = commander.facts()?.position_m(&bottle);
    walk_to(commander, &[WalkGoal { robot: B, to: at_hand(bottle_m, FRAC_PI_2), pace_m_s: WALK_M_S }])?;
    pick_up(commander, &giver(FRAC_PI_2), LIFT_M)?;
    let back = at_hand(bottle_m + BACK_M, FRAC_PI_2);
    let way = [(back, ON_THE_WAY), (place(TURNING_M, PI), ON_THE_WAY), (place(AT_HATCH_M, PI), AT_HAND)];
    for (to, within) in way {
        approach(commander, &[WalkGoal { robot: B, to, pace_m_s: CARRY_M_S }], within)?;
    }
    let bring = giver(PI).carry(commander, MEETING_M)?;
    commander.perform(1.2, &[bring])?;
    hand_over(commander, &giver(PI), &taker)?;
    let pad_m = commander.facts()?.position_m("target_pad");
    stand_on(commander, &taker, pad_m)
}
