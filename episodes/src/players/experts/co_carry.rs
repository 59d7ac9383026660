//! CoCarry: both robots take the bars, lift, side-step to the other shelf in step, set down and let go.

use std::f32::consts::PI;

use tandem_sim::{Pose, Vector};

use super::skills::{BarGrasp, Path, Stage, Team, let_go, take_softly, upright};
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
    let facts = stage.facts()?;
    let from = upright(&facts.object("basket").pose_in_world);
    let shelf_m = facts.position_m("basket_patch").z;
    let way_m = (facts.position_m("basket_patch") - from.translation).with_z(0.0);
    let length_m = way_m.length();
    let at = |gone_m: f32| {
        let along_m: Vector = way_m * (gone_m / length_m);
        Pose::from_parts(from.translation + along_m, from.rotation)
    };
    team.carry(stage, &Path { at: &at, length_m, pace_m_s: PACE_M_S })?;
    team.lower(stage, shelf_m)?;
    let_go(stage, &grasps)
}
