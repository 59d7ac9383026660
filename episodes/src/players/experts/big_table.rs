//! The BigTable expert: three robots take the edge with both hands, lift, and carry the table straight to
//! the disc in step. They set it down there and let go.

use std::f32::consts::PI;

use tandem_sim::Pose;

use super::skills::{CarryTeam, Commander, HandGrasp, Hold, grasp_compliantly, let_go, upright};
use crate::players::PlayerError;
use crate::scoring::{A, B, C};

const LIFT_M: f32 = 0.07;
/// Height of the pelvises over the floor: palms on the table top are then at elbow height.
const PELVIS_M: f32 = 0.75;
const PACE_M_S: f32 = 0.21;

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let third_rad = 2.0 * PI / 3.0;
    let [a_left, a_right] =
        HandGrasp::with_both_hands(A, "round_table", ["a_left", "a_right"], 0.0, &Hold::ROUND_EDGE);
    let [b_left, b_right] =
        HandGrasp::with_both_hands(B, "round_table", ["b_left", "b_right"], third_rad, &Hold::ROUND_EDGE);
    let [c_left, c_right] =
        HandGrasp::with_both_hands(C, "round_table", ["c_left", "c_right"], -third_rad, &Hold::ROUND_EDGE);
    let grasps = [a_left, a_right, b_left, b_right, c_left, c_right];
    let mut team = CarryTeam::new(commander, &grasps)?;
    for robot in [A, B, C] {
        commander.set_height(robot, PELVIS_M);
    }
    team.gather(commander)?;
    grasp_compliantly(commander, &grasps)?;
    team.lift(commander, LIFT_M)?;
    // The table's heading at the disc does not matter.
    let heading = upright(&team.object(commander)?).rotation;
    let place = Pose::from_parts(commander.facts()?.position_m("goal_disc"), heading);
    team.carry_to(commander, &place, PACE_M_S)?;
    team.rest(commander)?;
    team.set_down(commander, &place)?;
    let_go(commander, &grasps)
}
