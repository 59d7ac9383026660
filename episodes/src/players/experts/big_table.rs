//! BigTable: three robots take their rails, lift, carry the table straight to the disc in step, set down and let go.

use std::f32::consts::PI;

use tandem_sim::Pose;

use super::skills::{BarGrasp, Stage, Team, let_go, take_softly, upright};
use crate::players::PlayerError;
use crate::scoring::{A, B, C};

const LIFT_M: f32 = 0.07;
const PACE_M_S: f32 = 0.21;

pub fn perform(stage: &mut Stage) -> Result<(), PlayerError> {
    let third_rad = 2.0 * PI / 3.0;
    let [a_left, a_right] = BarGrasp::from_above(A, "round_table", ["a_left", "a_right"], 0.0);
    let [b_left, b_right] = BarGrasp::from_above(B, "round_table", ["b_left", "b_right"], third_rad);
    let [c_left, c_right] = BarGrasp::from_above(C, "round_table", ["c_left", "c_right"], -third_rad);
    let grasps = [a_left, a_right, b_left, b_right, c_left, c_right];
    let mut team = Team::new(stage, &grasps)?;
    team.gather(stage)?;
    take_softly(stage, &grasps)?;
    team.lift(stage, LIFT_M)?;
    // Which way it is turned there does not matter.
    let heading = upright(&team.object(stage)?).rotation;
    let place = Pose::from_parts(stage.facts()?.position_m("goal_disc"), heading);
    team.carry_to(stage, &place, PACE_M_S)?;
    team.rest(stage)?;
    team.set_down(stage, &place)?;
    let_go(stage, &grasps)
}
