//! The CartService expert: A takes the trolley's bar and pushes it to the mark. Meanwhile B walks up, lifts
//! the bottle out of its ring, steps back, turns to the table and puts the bottle on the patch.

use std::f32::consts::FRAC_PI_2;

use tandem_sim::{Pose, Side, Vector};

use super::skills::{
    CarryTeam, Commander, CylinderGrasp, HandGrasp, Hold, ParallelScript, Tolerance, WalkGoal, approach,
    at_hand, grasp_compliantly, in_parallel, let_go, pick_up_all, walk_to,
};
use crate::players::PlayerError;
use crate::scoring::{A, B};

const PUSH_M_S: f32 = 0.24;
const WALK_M_S: f32 = 0.35;
/// Maximum distance of the trolley from the mark before B takes the bottle. The trolley must also be slower
/// than `STANDS_M_S`.
const CAME_M: f32 = 0.3;
const STANDS_M_S: f32 = 0.03;
/// Maximum number of commands for which A waits for the trolley to stop.
const MAX_STOPPING_BEATS: u32 = 20;
/// Speed at which B walks with the bottle in its hand.
const CARRY_M_S: f32 = 0.25;
/// Height by which B lifts the bottle. While B walks, its pelvis and the bottle are up to 12 cm lower than
/// at rest. The bottle still has to clear the table.
const LIFT_M: f32 = 0.26;
/// Distance that B steps back from the trolley before it turns.
const BACK_M: f32 = 0.30;
const OVER_PATCH_M: f32 = 0.10;
const AT_HAND: Tolerance = Tolerance { off_m: 0.03, off_rad: 0.05 };
/// Tolerance for the waypoint on the way back, at which B already turns.
const ON_THE_WAY: Tolerance = Tolerance { off_m: 0.10, off_rad: 0.8 };
/// Height over the patch at which B lets go of the bottle.
const DROP_M: f32 = 0.003;

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let trolley = ParallelScript { robots: &[A], script: Box::new(park) };
    let bottle = ParallelScript { robots: &[B], script: Box::new(serve) };
    in_parallel(commander, vec![trolley, bottle])
}

/// Pushes the trolley to the mark and leaves it there; A's script.
fn park(commander: &mut Commander) -> Result<(), PlayerError> {
    let grasps = HandGrasp::with_both_hands(A, "service_trolley", ["left", "right"], -FRAC_PI_2, &Hold::BAR);
    let mut team = CarryTeam::new(commander, &grasps)?;
    team.gather(commander)?;
    grasp_compliantly(commander, &grasps)?;
    team.measure(commander)?;
    let mark = commander.facts()?.object("parking_mark").pose_in_world;
    team.carry_to(commander, &mark, PUSH_M_S)?;
    // A trolley that is released while it rolls keeps rolling.
    for _ in 0..MAX_STOPPING_BEATS {
        if commander.facts()?.speed_m_s("service_trolley") < STANDS_M_S {
            break;
        }
        commander.hold(A)?;
    }
    let_go(commander, &grasps)
}

/// Walks to the bottle's future place and serves the bottle once the trolley stands; B's script.
fn serve(commander: &mut Commander) -> Result<(), PlayerError> {
    let facts = commander.facts()?;
    let ring_m = facts.position_m("parking_mark") + facts.site("service_trolley", "ring").position_m();
    go(commander, at_hand(ring_m, FRAC_PI_2), WALK_M_S)?;
    await_trolley(commander)?;
    let bottle = |heading_rad: f32| CylinderGrasp {
        robot: B,
        side: Side::Right,
        object: "bottle",
        grip: "grip_high",
        heading_rad,
    };
    let grasp = bottle(FRAC_PI_2);
    let before = at_hand(commander.facts()?.position_m("bottle"), FRAC_PI_2);
    approach(commander, &[WalkGoal { robot: B, to: before, pace_m_s: WALK_M_S }], AT_HAND)?;
    pick_up_all(commander, &[grasp])?;
    let standing_m = commander.facts()?.position_m("bottle");
    let lift = grasp.carry(commander, standing_m + Vector::Z * LIFT_M)?;
    commander.perform(1.0, &[lift])?;

    let back = at_hand(standing_m - Vector::Y * BACK_M, FRAC_PI_2);
    approach(commander, &[WalkGoal { robot: B, to: back, pace_m_s: CARRY_M_S }], ON_THE_WAY)?;
    let patch_m = commander.facts()?.position_m("serving_patch");
    approach(commander, &[WalkGoal { robot: B, to: at_hand(patch_m, 0.0), pace_m_s: CARRY_M_S }], AT_HAND)?;
    let grasp = bottle(0.0);
    for (height_m, duration_s) in [(OVER_PATCH_M, 1.2), (DROP_M, 1.0)] {
        let over = grasp.carry(commander, patch_m + Vector::Z * height_m)?;
        commander.perform(duration_s, &[over])?;
    }
    commander.perform(0.6, &[grasp.open()])?;
    let away = grasp.away(commander)?;
    commander.perform(0.8, &[away])?;
    commander.perform(1.0, &[grasp.open()])
}

/// Holds B still until the trolley stands at the mark.
fn await_trolley(commander: &mut Commander) -> Result<(), PlayerError> {
    let mut came = false;
    loop {
        let facts = commander.facts()?;
        came |= facts.apart_m("service_trolley", "parking_mark") < CAME_M;
        if came && facts.speed_m_s("service_trolley") < STANDS_M_S {
            return Ok(());
        }
        commander.hold(B)?;
    }
}

fn go(commander: &mut Commander, to: Pose, pace_m_s: f32) -> Result<(), PlayerError> {
    walk_to(commander, &[WalkGoal { robot: B, to, pace_m_s }])
}
