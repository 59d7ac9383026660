//! The CoPouring expert: both robots put a hand on the bar at their end, lift, and turn the tub about the
//! bars over the crate.

use std::f32::consts::PI;

use tandem_sim::{Pose, Rotation, Side, Vector};

use super::skills::{Commander, HandGrasp, Hold, move_together, take_together, wrapped_rad};
use crate::players::PlayerError;
use crate::scoring::{A, B};

/// Closure of the fingers, a little more than round a bottle.
const CLOSURE: f32 = 1.15;

const LIFT_M: f32 = 0.12;
/// Sideways motion of the tub while it tips, which brings its lip over the crate. It also moves along the
/// bars to the crate's middle.
const OVER_CRATE_M: f32 = 0.18;
const TIP_RAD: f32 = 1.25;

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let hold = Hold { closed_rad: wrapped_rad(CLOSURE), ..Hold::BAR };
    let grasp =
        |robot, side, place, heading_rad| HandGrasp { robot, side, object: "tub", place, hold, heading_rad };
    let grasps = [grasp(A, Side::Left, "bar_a", 0.0), grasp(B, Side::Right, "bar_b", PI)];
    take_together(commander, &grasps)?;
    let facts = commander.facts()?;
    let start = facts.object("tub").pose_in_world;
    // The bars are the axis, so the hands turn and move little.
    let bars = Vector::new(0.0, 0.0, facts.site("tub", "bar_a").position_m().z);
    let along_m = facts.position_m("crate").x - start.translation.x;
    let tub_at = |lift_m: f32, over: f32, tip_rad: f32| {
        let rotation = Rotation::from_rotation_x(-tip_rad) * start.rotation;
        let axis_m = start.translation + bars + Vector::new(along_m * over, OVER_CRATE_M * over, lift_m);
        Pose::from_parts(axis_m - rotation * bars, rotation)
    };
    move_together(commander, &grasps, &|part| tub_at(LIFT_M * part, 0.0, 0.0), 5, 0.3)?;
    move_together(commander, &grasps, &|part| tub_at(LIFT_M, part, 0.5 * part), 6, 0.3)?;
    move_together(commander, &grasps, &|part| tub_at(LIFT_M, 1.0, 0.5 + (TIP_RAD - 0.5) * part), 8, 0.3)?;
    move_together(commander, &grasps, &|_| tub_at(LIFT_M, 1.0, TIP_RAD), 8, 0.4)
}
