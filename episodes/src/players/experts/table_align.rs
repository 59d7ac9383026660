//! TableAlign: both robots take the edges, lift, carry the table down the room while they turn it by a quarter, come at the
//! chair from its front, set down and let go.

use std::f32::consts::{FRAC_PI_2, PI};

use tandem_sim::Vector;

use super::skills::{
    CarryTeam, Commander, FREE, HandGrasp, Hold, ObjectPath, grasp_compliantly, let_go, place, upright,
};
use crate::players::PlayerError;
use crate::scoring::{A, B};

const LIFT_M: f32 = 0.07;
/// Pelvises over the floor: palms that lie on the top are then at elbow height.
const PELVIS_M: f32 = 0.75;
const PACE_M_S: f32 = 0.18;
/// The table's middle in the chair's frame: where the turn ends, clear of the chair, and where it is set down.
const BEFORE_CHAIR_M: Vector = Vector::new(0.65, 0.0, 0.0);
const AT_CHAIR_M: Vector = Vector::new(0.40, 0.0, 0.0);

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let [a_left, a_right] =
        HandGrasp::with_both_hands(A, "office_table", ["a_left", "a_right"], 0.0, &Hold::EDGE);
    let [b_left, b_right] =
        HandGrasp::with_both_hands(B, "office_table", ["b_left", "b_right"], PI, &Hold::EDGE);
    let grasps = [a_left, a_right, b_left, b_right];
    let mut team = CarryTeam::new(commander, &grasps)?;
    for robot in [A, B] {
        commander.set_height(robot, PELVIS_M);
    }
    team.gather(commander)?;
    grasp_compliantly(commander, &grasps)?;
    team.lift(commander, LIFT_M)?;
    let chair = commander.facts()?.object("office_chair").pose_in_world;
    let from = upright(&team.object(commander)?);
    let aloft = Vector::Z * from.translation.z;
    let [before, over] =
        [BEFORE_CHAIR_M, AT_CHAIR_M].map(|chair_m| place(chair * chair_m + aloft, FRAC_PI_2));
    let turn_m = (before.translation - from.translation).length();
    let length_m = turn_m + (over.translation - before.translation).length();
    let at = |gone_m: f32| match gone_m < turn_m {
        true => from.lerp(&before, gone_m / turn_m),
        false => before.lerp(&over, (gone_m - turn_m) / (length_m - turn_m)),
    };
    team.carry(commander, &ObjectPath { at: &at, length_m, pace_m_s: PACE_M_S, free_m: &FREE })?;
    team.set_down(commander, &place(chair * AT_CHAIR_M, FRAC_PI_2))?;
    let_go(commander, &grasps)
}
