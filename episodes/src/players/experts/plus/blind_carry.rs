//! The BlindCarry expert: both robots lift the table by its legs. On the way the table shifts sideways to the
//! gap, passes through it, and shifts back to the marks.

use std::f32::consts::PI;

use tandem_sim::{Pose, Vector};

use crate::players::PlayerError;
use crate::players::experts::skills::{
    CarryTeam, Commander, FREE, HandGrasp, Hold, ObjectPath, grasp_reached, let_go, place, smooth, upright,
};
use crate::scoring::{A, B};

const LIFT_M: f32 = 0.07;
/// Height of the pelvises above the floor while the robots grasp the legs and set the table down; `TALL_M` is
/// the height while they hold the table aloft.
const BENT_M: f32 = 0.64;
const TALL_M: f32 = 0.70;
const PACE_M_S: f32 = 0.22;
/// Position of the table's middle by which it has shifted over to the gap; from `BEHIND_WALL_X_M` on it
/// shifts back. B reaches the wall at the first, and A has left it at the second.
const BEFORE_WALL_X_M: f32 = -1.10;
const BEHIND_WALL_X_M: f32 = 1.15;

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let gap_m = commander.task().chosen("gap_m").and_then(|text| text.parse().ok()).unwrap_or_default();
    let [a_left, a_right] =
        HandGrasp::with_both_hands(A, "console_table", ["c_left", "c_right"], 0.0, &Hold::LEG);
    let [b_left, b_right] =
        HandGrasp::with_both_hands(B, "console_table", ["b_left", "b_right"], PI, &Hold::LEG);
    let grasps = [a_left, a_right, b_left, b_right];
    let mut team = CarryTeam::new(commander, &grasps)?;
    set_heights(commander, BENT_M);
    team.gather_reaching(commander)?;
    grasp_reached(commander, &grasps)?;
    team.give_way(commander, true);
    team.lift(commander, LIFT_M)?;
    set_heights(commander, TALL_M);
    let marks = commander.facts()?.object("foot_marks").pose_in_world;
    let from = upright(&team.object(commander)?);
    let length_m = marks.translation.x - from.translation.x;
    let at = |gone_m: f32| through_gap(&from, &marks, gap_m, gone_m);
    team.carry(commander, &ObjectPath { at: &at, length_m, pace_m_s: PACE_M_S, free_m: &FREE })?;
    set_heights(commander, BENT_M);
    team.set_down(commander, &marks)?;
    // The squares are small, and compliant hands would shift the table as they open.
    team.give_way(commander, false);
    let_go(commander, &grasps)
}

/// Returns the table's pose after `gone_m` along x: over to the gap, through it, and over to the marks.
fn through_gap(from: &Pose, to: &Pose, gap_m: f32, gone_m: f32) -> Pose {
    let x_m = from.translation.x + gone_m;
    let share = |begin_m: f32, end_m: f32| smooth(((x_m - begin_m) / (end_m - begin_m)).clamp(0.0, 1.0));
    let over = share(from.translation.x, BEFORE_WALL_X_M);
    let back = share(BEHIND_WALL_X_M, to.translation.x);
    let y_m = from.translation.y * (1.0 - over) + gap_m * (over - back) + to.translation.y * back;
    let heading_rad = tandem_sim::heading_rad(from) * (1.0 - over);
    place(Vector::new(x_m, y_m, from.translation.z), heading_rad)
}

/// Sets the heights of both pelvises from the next commands on.
fn set_heights(commander: &mut Commander, height_m: f32) {
    for robot in [A, B] {
        commander.set_height(robot, height_m);
    }
}
