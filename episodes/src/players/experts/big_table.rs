//! BigTable: three robots take their rails, lift, carry the table straight to the disc in step, set down and let go.

use std::f32::consts::PI;

use tandem_sim::Pose;

use super::skills::{BEHIND_BAR_M, BarGrasp, Path, Stage, Team, let_go, take_softly, upright};
use crate::players::PlayerError;
use crate::scoring::{A, B, C};

const LIFT_M: f32 = 0.07;
const PACE_M_S: f32 = 0.18;

pub fn perform(stage: &mut Stage) -> Result<(), PlayerError> {
    let third_rad = 2.0 * PI / 3.0;
    let [a_left, a_right] = BarGrasp::from_above(A, "round_table", ["a_left", "a_right"], 0.0);
    let [b_left, b_right] = BarGrasp::from_above(B, "round_table", ["b_left", "b_right"], third_rad);
    let [c_left, c_right] = BarGrasp::from_above(C, "round_table", ["c_left", "c_right"], -third_rad);
    let grasps = [a_left, a_right, b_left, b_right, c_left, c_right];
    let mut team = Team::new(stage, &grasps, BEHIND_BAR_M)?;
    team.gather(stage)?;
    take_softly(stage, &grasps)?;
    team.lift(stage, LIFT_M)?;
    let from = upright(&team.object(stage)?);
    let disc_m = stage.facts()?.position_m("goal_disc");
    let over = Pose::from_parts(disc_m.with_z(from.translation.z), from.rotation);
    let length_m = (over.translation - from.translation).length();
    let at = |gone_m: f32| from.lerp(&over, gone_m / length_m);
    team.carry(stage, &Path { at: &at, length_m, pace_m_s: PACE_M_S })?;
    team.set_down(stage, &Pose::from_parts(disc_m, from.rotation))?;
    let_go(stage, &grasps)
}
