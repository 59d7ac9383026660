//! The Relay expert: A gives the bottle to B, which turns between the counters and gives it to C, which
//! puts it on the wanted pad.

use std::f32::consts::{FRAC_PI_2, PI};

use tandem_sim::{Side, Vector};

use crate::players::PlayerError;
use crate::players::experts::skills::{
    Commander, CylinderGrasp, Tolerance, WalkGoal, approach, hand_over, pick_up, place, stand_on,
};
use crate::scoring::{A, B, C};

/// Grasp of the first robot. On the straight part of the bottle, one hand is above the other; B's is the
/// upper one.
const FIRST: CylinderGrasp =
    CylinderGrasp { robot: A, side: Side::Right, object: "bottle", grip: "grip_low", heading_rad: 0.0 };
const LAST: CylinderGrasp =
    CylinderGrasp { robot: C, side: Side::Right, object: "bottle", grip: "grip_low", heading_rad: PI };
const LIFT_M: Vector = Vector::new(0.0, 0.0, 0.10);
/// Places above each counter where the bottle changes hands.
const FIRST_MEETING_M: Vector = Vector::new(0.36, -0.06, 0.92);
const SECOND_MEETING_M: Vector = Vector::new(1.66, -0.06, 0.92);
/// Place of the bottle before B walks. B's pelvis sinks by up to 12 cm while it walks.
const ALOFT_M: Vector = Vector::new(0.40, -0.06, 1.06);
/// Waypoints of B: a step back, two quarter turns, and up to the second counter.
const WAY: [(Vector, f32, Tolerance); 3] = [
    (Vector::new(0.98, -0.10, 0.0), PI, ON_THE_WAY),
    (Vector::new(1.02, -0.05, 0.0), -FRAC_PI_2, ON_THE_WAY),
    (Vector::new(1.30, 0.0, 0.0), 0.0, AT_HAND),
];
const CARRY_M_S: f32 = 0.25;
const AT_HAND: Tolerance = Tolerance { off_m: 0.03, off_rad: 0.05 };
const ON_THE_WAY: Tolerance = Tolerance { off_m: 0.10, off_rad: 0.5 };

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    pick_up(commander, &FIRST, LIFT_M)?;
    let bring = FIRST.carry(commander, FIRST_MEETING_M)?;
    commander.perform(1.0, &[bring])?;
    hand_over(commander, &FIRST, &between(PI))?;
    let aloft = between(PI).carry(commander, ALOFT_M)?;
    commander.perform(1.0, &[aloft])?;
    for (to_m, heading_rad, within) in WAY {
        let goal = WalkGoal { robot: B, to: place(to_m, heading_rad), pace_m_s: CARRY_M_S };
        approach(commander, &[goal], within)?;
    }
    let bring = between(0.0).carry(commander, SECOND_MEETING_M)?;
    commander.perform(1.2, &[bring])?;
    hand_over(commander, &between(0.0), &LAST)?;
    let back = between(0.0).out_of_the_way(commander)?;
    commander.perform(0.8, &[back])?;
    let wanted = commander.task().chosen("wanted").unwrap_or_default();
    let pad_m = commander.facts()?.position_m(&format!("{wanted}_pad"));
    stand_on(commander, &LAST, pad_m)
}

/// Returns the grasp of B's hand while B faces this way.
fn between(heading_rad: f32) -> CylinderGrasp<'static> {
    CylinderGrasp { robot: B, side: Side::Right, object: "bottle", grip: "grip_high", heading_rad }
}
