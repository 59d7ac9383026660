//! CoCarry: both robots take the bars, lift, side-step to the other shelf in step, set down and let go.

use std::f32::consts::PI;

use super::skills::{BarGrasp, Stage, Team, let_go, take_softly};
use crate::players::PlayerError;
use crate::scoring::{A, B};

const LIFT_M: f32 = 0.09;
const PACE_M_S: f32 = 0.2;

pub fn perform(stage: &mut Stage) -> Result<(), PlayerError> {
    let [a_left, a_right] = BarGrasp::from_above(A, "basket", ["a_left", "a_right"], 0.0);
    let [b_left, b_right] = BarGrasp::from_above(B, "basket", ["b_left", "b_right"], PI);
    let grasps = [a_left, a_right, b_left, b_right];
    let mut team = Team::new(stage, &grasps)?;
    team.gather(stage)?;
    take_softly(stage, &grasps)?;
    team.lift(stage, LIFT_M)?;
    let patch = stage.facts()?.object("basket_patch").pose_in_world;
    team.carry_to(stage, &patch, PACE_M_S)?;
    team.set_down(stage, &patch)?;
    let_go(stage, &grasps)
}
