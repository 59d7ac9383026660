//! The CoCarry expert: both robots take the rim, lift, side-step to the other shelf in step, set down and
//! let go.

use std::f32::consts::PI;

use super::skills::{CarryTeam, Commander, HandGrasp, Hold, grasp_compliantly, let_go};
use crate::players::PlayerError;
use crate::scoring::{A, B};

const LIFT_M: f32 = 0.09;
const PACE_M_S: f32 = 0.2;

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let [a_left, a_right] = HandGrasp::with_both_hands(A, "basket", ["a_left", "a_right"], 0.0, &Hold::RIM);
    let [b_left, b_right] = HandGrasp::with_both_hands(B, "basket", ["b_left", "b_right"], PI, &Hold::RIM);
    let grasps = [a_left, a_right, b_left, b_right];
    let mut team = CarryTeam::new(commander, &grasps)?;
    team.gather(commander)?;
    grasp_compliantly(commander, &grasps)?;
    team.lift(commander, LIFT_M)?;
    let patch = commander.facts()?.object("basket_patch").pose_in_world;
    team.carry_to(commander, &patch, PACE_M_S)?;
    team.set_down(commander, &patch)?;
    let_go(commander, &grasps)
}
