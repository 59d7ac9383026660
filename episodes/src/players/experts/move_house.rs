//! The MoveHouse expert: A walks to the door, presses its lever, pushes the door open along its swing and
//! steps aside in the other room. Meanwhile B and C lift the table; they follow A through the doorway in
//! step and set it down on the marks.

use std::f32::consts::{FRAC_PI_2, PI};

use tandem_sim::{Pose, Rotation, Side, Sides, Vector};

use super::skills::{
    CarryTeam, Commander, FREE, HandGrasp, HandMove, Hold, ParallelScript, Posture, PosturePath, WalkGoal,
    at_height, closed_rad, follow, grasp_reached, in_parallel, let_go, place, walk_reaching, walk_to,
};
use crate::players::PlayerError;
use crate::scoring::{A, B, C, Facts};

const LIFT_M: f32 = 0.07;
/// Height of the pelvises above the floor while the robots grasp the legs and set the table down. `TALL_M` is
/// the height while they hold the table aloft. The pelvis of a walking robot is below 0.68 m whatever is
/// commanded.
const BENT_M: f32 = 0.64;
const TALL_M: f32 = 0.70;
const PACE_M_S: f32 = 0.27;
/// Distance from the wrist to the pressing part of a fist, palm down. `FRONT_M` is the distance to the fist's
/// front.
const PRESSING_M: f32 = 0.115;
const FRONT_M: f32 = 0.16;
/// Distance behind the lever at which the fist closes. The wrist then rises `ABOVE_LEVER_M` above the lever's
/// end and goes down in steps of `DOWN_M` until the bolt is drawn.
const BACK_M: f32 = 0.10;
const ABOVE_LEVER_M: f32 = 0.11;
const DOWN_M: [f32; 4] = [-0.02, -0.05, -0.08, -0.11];
/// Travel of a drawn bolt. The bolt reaches 20 mm into its hole.
const DRAWN_M: f32 = 0.022;
/// x coordinate of the leaf's face on the robot's side, in the leaf's frame, and distances from the hinge at
/// which the robot pushes. The first is beside the lever. The last is nearer to the hinge, so that the robot
/// passes through the middle of the doorway.
const FACE_X_M: f32 = -0.045;
const FIRST_RADIUS_M: f32 = 0.785;
const LAST_RADIUS_M: f32 = 0.50;
const MOVED_IN_RAD: f32 = 0.6;
const OPEN_RAD: f32 = 1.53;
/// Distance of the fist's goal beyond the face, which makes it push.
const PRESS_M: f32 = 0.02;
const PUSH_M_S: f32 = 0.26;
/// Ratio of the robot's turn to the leaf's angle.
const TURN_RATIO: f32 = 0.6;
/// Distances ahead of the robot and to its right at which it pushes.
const AHEAD_M: f32 = 0.45;
const RIGHT_M: f32 = 0.10;
/// Time for which A still corrects its place at the end of the swing.
const OPENED_S: f32 = 0.4;
/// Distance that B keeps behind A until A is out of the way.
const APART_M: f32 = 0.75;
const BESIDE_Y_M: f32 = -0.75;
/// Position of A while it presses the lever, in the door's frame.
const BEFORE_M: Vector = Vector::new(-0.50, -0.15, 0.0);
/// Position of A beside its partners' path, in the door's frame.
const ASIDE_M: Vector = Vector::new(0.75, -1.05, 0.0);
/// Maximum speed of A on its way to the lever, and to its place aside.
const APPROACH_M_S: f32 = 0.4;
const WALK_M_S: f32 = 0.3;

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let door = ParallelScript { robots: &[A], script: Box::new(clear_the_way) };
    let table = ParallelScript { robots: &[B, C], script: Box::new(carry_table) };
    in_parallel(commander, vec![door, table])
}

/// Opens the door and steps aside; A's script.
fn clear_the_way(commander: &mut Commander) -> Result<(), PlayerError> {
    open_door(commander)?;
    let door = commander.facts()?.object("lever_door").pose_in_world;
    walk_to(commander, &[WalkGoal { robot: A, to: place(door * ASIDE_M, FRAC_PI_2), pace_m_s: WALK_M_S }])
}

/// Takes the table, follows A through the doorway and sets it down on its marks; the script of B and C.
fn carry_table(commander: &mut Commander) -> Result<(), PlayerError> {
    let [b_left, b_right] =
        HandGrasp::with_both_hands(B, "console_table", ["b_left", "b_right"], PI, &Hold::LEG);
    let [c_left, c_right] =
        HandGrasp::with_both_hands(C, "console_table", ["c_left", "c_right"], 0.0, &Hold::LEG);
    let grasps = [b_left, b_right, c_left, c_right];
    let mut team = CarryTeam::new(commander, &grasps)?;
    set_heights(commander, BENT_M);
    // A walking robot's thighs hit the table's legs if the robot is too near or not centred behind them.
    team.gather_reaching(commander)?;
    grasp_reached(commander, &grasps)?;
    // Two robots that lift with stiff hands lean back against each other's pull, and stagger.
    team.give_way(commander, true);
    team.lift(commander, LIFT_M)?;
    set_heights(commander, TALL_M);
    let facts = commander.facts()?;
    let marks = facts.object("foot_marks").pose_in_world;
    let b_x_m = facts.robots[B].pelvis_in_world.translation.x;
    let free_m = |facts: &Facts| match facts.robots[A].pelvis_in_world.translation {
        a_m if a_m.y < BESIDE_Y_M => f32::INFINITY,
        a_m => a_m.x - APART_M - b_x_m,
    };
    team.carry_where_free(commander, &marks, PACE_M_S, &free_m)?;
    set_heights(commander, BENT_M);
    team.set_down(commander, &marks)?;
    // The squares are small, and compliant hands would shift the table as they open.
    team.give_way(commander, false);
    let_go(commander, &grasps)
}

/// Sets the pelvis heights of B and C from their next commands on.
fn set_heights(commander: &mut Commander, height_m: f32) {
    for robot in [B, C] {
        commander.set_height(robot, height_m);
    }
}

/// Opens the door: A walks up to the lever, presses it with its right fist and follows the leaf on its
/// swing.
fn open_door(commander: &mut Commander) -> Result<(), PlayerError> {
    let leaf = commander.facts()?.object("lever_door leaf").pose_in_world;
    let pressed_m = press_lever(commander)?;
    let robot = &commander.facts()?.robots[A];
    let (left_in_pelvis, pelvis_m) = (robot.wrist_in_pelvis.left, robot.pelvis_in_world.translation.z);
    let at = |gone_m: f32| {
        let (stand, wrist) = push(&leaf, gone_m / FIRST_RADIUS_M, pressed_m);
        let pelvis = at_height(&stand, pelvis_m);
        vec![Posture { robot: A, stand, wrists: Sides { left: pelvis * left_in_pelvis, right: wrist } }]
    };
    let length_m = OPEN_RAD * FIRST_RADIUS_M;
    follow(commander, &PosturePath { at: &at, length_m, pace_m_s: PUSH_M_S, hold_s: OPENED_S, free_m: &FREE })
}

/// Walks up to the lever, presses it until the bolt is drawn, and returns the height of the wrist then.
fn press_lever(commander: &mut Commander) -> Result<f32, PlayerError> {
    let facts = commander.facts()?;
    let end_m = facts.site_m("lever_door lever", "end");
    let bolt_m = |facts: &Facts| facts.seen_from_m("lever_door leaf", "lever_door bolt").y;
    let shut_m = bolt_m(&facts);
    walk_to_lever(commander, &facts, end_m)?;
    commander.perform(0.6, &[fist_at(end_m, 0.0, ABOVE_LEVER_M)])?;
    for down_m in DOWN_M {
        commander.perform(0.6, &[fist_at(end_m, 0.0, down_m)])?;
        if bolt_m(&commander.facts()?) - shut_m >= DRAWN_M {
            return Ok(end_m.z + down_m);
        }
    }
    Err(PlayerError::GaveUp("the lever could not be pressed down".into()))
}

/// Walks up to the lever; meanwhile the right hand makes a fist behind the lever's end.
fn walk_to_lever(commander: &mut Commander, facts: &Facts, end_m: Vector) -> Result<(), PlayerError> {
    let to = place(facts.object("lever_door").pose_in_world * BEFORE_M, 0.0);
    let robot = &facts.robots[A];
    let pelvis = at_height(&to, robot.pelvis_in_world.translation.z);
    let hands = Sides {
        left: HandMove::reach(A, Side::Left, pelvis * robot.wrist_in_pelvis.left),
        right: fist_at(end_m, BACK_M, ABOVE_LEVER_M).shaped(closed_rad(Side::Right)),
    };
    walk_reaching(commander, &[WalkGoal { robot: A, to, pace_m_s: APPROACH_M_S }], &[hands])
}

/// Returns the move of the right fist, palm down, to a place behind and above the lever's end.
fn fist_at(end_m: Vector, back_m: f32, above_m: f32) -> HandMove {
    let wrist_m = end_m + Vector::new(-PRESSING_M - back_m, 0.0, above_m);
    HandMove::reach(A, Side::Right, Pose::from_parts(wrist_m, Rotation::from_rotation_x(-FRAC_PI_2)))
}

/// Returns A's place on the floor, and the pose of its right wrist at `height_m`, with which it pushes the
/// leaf to an angle. `shut` is the pose of the shut leaf.
fn push(shut: &Pose, angle_rad: f32, height_m: f32) -> (Pose, Pose) {
    let share = (angle_rad / MOVED_IN_RAD).min(1.0);
    let radius_m = FIRST_RADIUS_M + (LAST_RADIUS_M - FIRST_RADIUS_M) * share;
    let leaf = *shut * Pose::from_rotation(Rotation::from_rotation_z(angle_rad));
    let wrist_in_leaf_m = Vector::new(FACE_X_M - FRONT_M + PRESS_M, -radius_m, height_m);
    let wrist = leaf * Pose::from_parts(wrist_in_leaf_m, Rotation::from_rotation_x(-FRAC_PI_2));
    let point_m = leaf * Vector::new(FACE_X_M, -radius_m, 0.0);
    let facing = place(Vector::ZERO, TURN_RATIO * angle_rad);
    (place(point_m - facing * Vector::new(AHEAD_M, -RIGHT_M, 0.0), TURN_RATIO * angle_rad), wrist)
}
