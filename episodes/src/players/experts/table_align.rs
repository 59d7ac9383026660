//! The TableAlign expert: both robots take the edges, lift, and carry the table down the room while they turn
//! it by a quarter. They approach the chair from its front and from one side, set the table down and let go.

use std::f32::consts::{FRAC_PI_2, PI};

use tandem_sim::Vector;

use super::skills::{CarryTeam, Commander, HandGrasp, Hold, grasp_compliantly, let_go, place};
use crate::players::PlayerError;
use crate::scoring::{A, B};

const LIFT_M: f32 = 0.07;
/// Height of the pelvises over the floor: palms on the table top are then at elbow height.
const PELVIS_M: f32 = 0.75;
/// Pace of the robot that has farthest to walk.
const PACE_M_S: f32 = 0.29;
/// Position of the table's middle in the chair's frame at the end of the turn, clear of the chair;
/// `AT_CHAIR_M` is where it is set down.
const BEFORE_CHAIR_M: Vector = Vector::new(0.52, -0.30, 0.0);
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
    let aloft = Vector::Z * team.object(commander)?.translation.z;
    let stops = [BEFORE_CHAIR_M, AT_CHAIR_M].map(|chair_m| place(chair * chair_m + aloft, FRAC_PI_2));
    team.carry_by(commander, &stops, PACE_M_S)?;
    team.set_down(commander, &place(chair * AT_CHAIR_M, FRAC_PI_2))?;
    let_go(commander, &grasps)
}
