//! TableAlign: both robots take the rails, lift, carry the table down the room while they turn it by a quarter, come at the chair from
//! its front, set down and let go.

use std::f32::consts::{FRAC_PI_2, PI};

use tandem_sim::{Pose, Rotation, Vector};

use super::skills::{BarGrasp, Path, Stage, Team, let_go, take_softly, upright};
use crate::players::PlayerError;
use crate::scoring::{A, B};

const LIFT_M: f32 = 0.07;
const PACE_M_S: f32 = 0.16;
/// The table's middle in the chair's frame: where the turn ends, clear of the chair, and where it is set down.
const BEFORE_CHAIR_M: Vector = Vector::new(0.70, 0.0, 0.0);
const AT_CHAIR_M: Vector = Vector::new(0.40, 0.0, 0.0);

pub fn perform(stage: &mut Stage) -> Result<(), PlayerError> {
    let [a_left, a_right] = BarGrasp::from_above(A, "office_table", ["a_left", "a_right"], 0.0);
    let [b_left, b_right] = BarGrasp::from_above(B, "office_table", ["b_left", "b_right"], PI);
    let grasps = [a_left, a_right, b_left, b_right];
    let mut team = Team::new(stage, &grasps)?;
    team.gather(stage)?;
    take_softly(stage, &grasps)?;
    team.lift(stage, LIFT_M)?;
    let facts = stage.facts()?;
    let chair = facts.object("office_chair").pose_in_world;
    let from = upright(&facts.object("office_table").pose_in_world);
    let height = Vector::Z * from.translation.z;
    let turned = Rotation::from_rotation_z(FRAC_PI_2);
    let before = Pose::from_parts(chair * BEFORE_CHAIR_M + height, turned);
    let place = Pose::from_parts(chair * AT_CHAIR_M + height, turned);
    for (start, end) in [(from, before), (before, place)] {
        let length_m = (end.translation - start.translation).length();
        let at = |gone_m: f32| start.lerp(&end, gone_m / length_m);
        team.carry(stage, &Path { at: &at, length_m, pace_m_s: PACE_M_S })?;
    }
    team.lower(stage, 0.0)?;
    let_go(stage, &grasps)
}
