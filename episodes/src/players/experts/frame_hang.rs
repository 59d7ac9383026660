//! The FrameHang expert: each robot takes one side of the frame. Both lift it in front of the peg, push the
//! loop over it and lower.

use std::f32::consts::FRAC_PI_2;

use tandem_sim::{Pose, Side, Vector};

use super::skills::{
    COMPLIANCE_N_S_M, Commander, HandGrasp, HandMove, Hold, move_together, take_together, wrapped_rad,
};
use crate::players::PlayerError;
use crate::scoring::{A, B, Facts};

/// Hold of the upright moulding, 50 x 40 mm, with the palm on its outside.
const MOULDING: Hold = Hold {
    turned_rad: [0.0; 3],
    place_in_wrist_m: Vector::new(0.112, 0.045, 0.0),
    closed_rad: wrapped_rad(1.1),
    ..Hold::BAR
};

/// Position of the loop's middle relative to the peg's tip: in front of the tip, past it, and resting on
/// the peg.
const BEFORE_M: Vector = Vector::new(0.0, -0.045, 0.004);
const PAST_M: Vector = Vector::new(0.0, 0.040, 0.002);
const RESTING_M: Vector = Vector::new(0.0, 0.045, -0.034);
const LEG_S: f32 = 0.3;
/// Number of attempts. A frame that missed the peg, or is tilted by more than `ASKEW_RAD`, is taken off and
/// hung again.
const TRIES: u32 = 3;
const ASKEW_RAD: f32 = 0.2;
/// Closure of fingers that open as far as the wall behind the frame lets them. The hands then move outwards
/// and back.
const LOOSE: f32 = 0.35;
const OUTWARDS_M: f32 = 0.13;
const BACK_M: f32 = 0.14;

/// Hangs the frame. A frame that both robots already hold is not grasped again. A frame whose loop is over
/// the peg is only lowered.
pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let grasp = |robot, side, place| HandGrasp {
        robot,
        side,
        object: "frame",
        place,
        hold: MOULDING,
        heading_rad: FRAC_PI_2,
    };
    let grasps = [grasp(A, Side::Left, "left_side"), grasp(B, Side::Right, "right_side")];
    let held = |facts: &Facts| [A, B].iter().all(|robot| facts.holds_any(*robot, "frame"));
    if !held(&commander.facts()?) {
        take_together(commander, &grasps)?;
    }
    let facts = commander.facts()?;
    let start = facts.object("frame").pose_in_world;
    let tip_m = facts.site_m("wall_peg", "tip");
    let upright = |loop_m: Vector| Pose::from_translation(loop_m - facts.site("frame", "loop").position_m());
    let before = upright(tip_m + BEFORE_M);
    let raised_m = Vector::new(start.translation.x, start.translation.y, before.translation.z);
    let raised = Pose::from_translation(raised_m);
    let go = |commander: &mut Commander, from: Pose, to: Pose, count: u32| {
        move_together(commander, &grasps, &|part| from.lerp(&to, part), count, LEG_S)
    };
    let (past, resting) = (upright(tip_m + PAST_M), upright(tip_m + RESTING_M));
    if is_straight_on_peg(&facts) {
        give_way(commander, true);
        go(commander, start, resting, 4)?;
        return let_go(commander, &grasps);
    }
    go(commander, start, raised, 8)?;
    go(commander, raised, before, 5)?;
    for _ in 0..TRIES {
        go(commander, before, past, 6)?;
        if is_straight_on_peg(&commander.facts()?) {
            give_way(commander, true);
            go(commander, past, resting, 4)?;
            if is_straight_on_peg(&commander.facts()?) {
                return let_go(commander, &grasps);
            }
            give_way(commander, false);
        }
        // Takes the frame off the way it came, and tries once more with the present grips.
        let missed = commander.facts()?.object("frame").pose_in_world;
        let above_m = Vector::new(missed.translation.x, missed.translation.y, past.translation.z);
        let above = Pose::from_translation(above_m);
        go(commander, missed, above, 4)?;
        go(commander, above, before, 6)?;
    }
    Err(PlayerError::GaveUp("the frame does not hang straight on the peg".into()))
}

/// Makes the hands of both robots compliant, or stiff again. The peg and the wall stop a frame before its
/// hands reach their goals, and robots with stiff hands would push themselves off their feet.
fn give_way(commander: &mut Commander, give_way: bool) {
    for robot in [A, B] {
        commander.set_compliance(robot, give_way.then_some(COMPLIANCE_N_S_M));
    }
}

/// Returns `true` if the frame hangs straight on the peg. A frame that hangs askew when it is released stays
/// so, because no hand has room behind it to take it again.
fn is_straight_on_peg(facts: &Facts) -> bool {
    facts.threads("wall_peg", ["root", "tip"], "frame", "loop") && facts.tilt_rad("frame") < ASKEW_RAD
}

fn let_go(commander: &mut Commander, grasps: &[HandGrasp]) -> Result<(), PlayerError> {
    let hold = Hold { closed_rad: wrapped_rad(LOOSE), ..MOULDING };
    let loose = |grasp: &HandGrasp| HandGrasp { hold, ..*grasp }.close();
    let loosen: Vec<HandMove> = grasps.iter().map(loose).collect();
    commander.perform(0.5, &loosen)?;
    for step_m in [Vector::new(OUTWARDS_M, 0.0, 0.0), Vector::new(0.0, -BACK_M, 0.0)] {
        let mut moves = Vec::with_capacity(grasps.len());
        for grasp in grasps {
            let wrist = commander.world_from_wrist(grasp.robot, grasp.side)?;
            let outwards = -grasp.side.sign();
            let by_m = Vector::new(step_m.x * outwards, step_m.y, step_m.z);
            moves.push(HandMove::reach(
                grasp.robot,
                grasp.side,
                Pose::from_parts(wrist.translation + by_m, wrist.rotation),
            ));
        }
        commander.perform(0.9, &moves)?;
    }
    // The frame still swings a little.
    commander.perform(3.0, &grasps.iter().map(HandGrasp::open).collect::<Vec<_>>())
}
