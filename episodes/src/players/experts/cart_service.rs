//! CartService: A takes the trolley's bar and pushes it to the mark. Meanwhile B walks up; it lifts the bottle out of its ring, steps back, turns to the
//! table and stands the bottle on the patch.

use std::f32::consts::FRAC_PI_2;

use tandem_sim::{Pose, Side, Vector};

use super::skills::{
    BarGrasp, CylinderGrasp, Part, Stage, Team, Way, Within, at_once, come_near, let_go, pick_up_all, place,
    take_softly, walk_to,
};
use crate::players::PlayerError;
use crate::scoring::{A, B};

const PUSH_M_S: f32 = 0.24;
const WALK_M_S: f32 = 0.35;
/// B takes a trolley that has been this near to the mark, once it is slower than this.
const CAME_M: f32 = 0.3;
const STANDS_M_S: f32 = 0.03;
/// For so many commands A waits for that, too.
const MOST_STOPPING_BEATS: u32 = 20;
/// With the bottle in hand.
const CARRY_M_S: f32 = 0.25;
/// Where a robot has what its right hand takes: ahead of the pelvis, and to the right.
const AT_HAND_M: Vector = Vector::new(0.40, -0.10, 0.0);
const LIFT_M: f32 = 0.16;
/// Away from the trolley before B turns.
const BACK_M: f32 = 0.30;
const OVER_PATCH_M: f32 = 0.10;
const AT_HAND: Within = Within { off_m: 0.03, off_rad: 0.05 };
/// On the way back B already turns.
const ON_THE_WAY: Within = Within { off_m: 0.10, off_rad: 0.8 };
/// A bottle that is let go of falls so far.
const DROP_M: f32 = 0.003;

pub fn perform(stage: &mut Stage) -> Result<(), PlayerError> {
    let trolley = Part { robots: &[A], script: Box::new(park) };
    let bottle = Part { robots: &[B], script: Box::new(serve) };
    at_once(stage, vec![trolley, bottle])
}

/// A pushes the trolley to the mark and leaves it there.
fn park(stage: &mut Stage) -> Result<(), PlayerError> {
    let grasps = BarGrasp::from_above(A, "service_trolley", ["left", "right"], -FRAC_PI_2);
    let mut team = Team::new(stage, &grasps)?;
    team.gather(stage)?;
    take_softly(stage, &grasps)?;
    team.measure(stage)?;
    let mark = stage.facts()?.object("parking_mark").pose_in_world;
    team.carry_to(stage, &mark, PUSH_M_S)?;
    // What is let go of while it rolls rolls on.
    for _ in 0..MOST_STOPPING_BEATS {
        if stage.facts()?.speed_m_s("service_trolley") < STANDS_M_S {
            break;
        }
        stage.hold(A)?;
    }
    let_go(stage, &grasps)
}

/// B walks to where it will find the bottle, and serves it once the trolley stands.
fn serve(stage: &mut Stage) -> Result<(), PlayerError> {
    let facts = stage.facts()?;
    let ring_m = facts.position_m("parking_mark") + facts.site("service_trolley", "ring").position_m();
    go(stage, at_hand(ring_m, FRAC_PI_2), WALK_M_S)?;
    await_trolley(stage)?;
    let bottle = |heading_rad: f32| CylinderGrasp {
        robot: B,
        side: Side::Right,
        object: "bottle",
        grip: "grip_high",
        heading_rad,
    };
    let grasp = bottle(FRAC_PI_2);
    let before = at_hand(stage.facts()?.position_m("bottle"), FRAC_PI_2);
    come_near(stage, &[Way { robot: B, to: before, pace_m_s: WALK_M_S }], AT_HAND)?;
    pick_up_all(stage, &[grasp])?;
    let standing_m = stage.facts()?.position_m("bottle");
    let lift = grasp.carry(stage, standing_m + Vector::Z * LIFT_M)?;
    stage.perform(1.0, &[lift])?;

    let back = at_hand(standing_m - Vector::Y * BACK_M, FRAC_PI_2);
    come_near(stage, &[Way { robot: B, to: back, pace_m_s: CARRY_M_S }], ON_THE_WAY)?;
    let patch_m = stage.facts()?.position_m("serving_patch");
    come_near(stage, &[Way { robot: B, to: at_hand(patch_m, 0.0), pace_m_s: CARRY_M_S }], AT_HAND)?;
    let grasp = bottle(0.0);
    for (height_m, duration_s) in [(OVER_PATCH_M, 1.2), (DROP_M, 1.0)] {
        let over = grasp.carry(stage, patch_m + Vector::Z * height_m)?;
        stage.perform(duration_s, &[over])?;
    }
    stage.perform(0.6, &[grasp.open()])?;
    let away = grasp.away(stage)?;
    stage.perform(0.8, &[away])?;
    stage.perform(1.0, &[grasp.open()])
}

/// B waits until the trolley has come to the mark and stands.
fn await_trolley(stage: &mut Stage) -> Result<(), PlayerError> {
    let mut came = false;
    loop {
        let facts = stage.facts()?;
        came |= facts.apart_m("service_trolley", "parking_mark") < CAME_M;
        if came && facts.speed_m_s("service_trolley") < STANDS_M_S {
            return Ok(());
        }
        stage.hold(B)?;
    }
}

/// Where B stands to have `point_m` before its right hand.
fn at_hand(point_m: Vector, heading_rad: f32) -> Pose {
    let facing = place(Vector::ZERO, heading_rad);
    place(point_m - facing * AT_HAND_M, heading_rad)
}

fn go(stage: &mut Stage, to: Pose, pace_m_s: f32) -> Result<(), PlayerError> {
    walk_to(stage, &[Way { robot: B, to, pace_m_s }])
}
