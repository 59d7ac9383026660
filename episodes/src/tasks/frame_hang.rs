//! FrameHang: two robots lift a large picture frame and hang its loop on a peg in the wall.
//!
//! Conditions, tolerances and randomisation are the benchmark's. Where it is silent we chose what two G1s carry: a frame of
//! 0.90 x 0.95 m and 2.6 kg that waits upright in a rack on the floor, so that its sides are at hand height.

use std::f32::consts::FRAC_PI_2;

use super::{Offset, RobotSpot, Task, spot, uniform_xy};
use crate::scoring::nearness::{all, come, grips, in_hands, is};
use crate::scoring::placement::RELEASE_S;
use crate::scoring::{A, B, Done, Facts, Phase};

const FRAME_Y_M: f32 = 0.34;
/// Surface of the wall.
const WALL_Y_M: f32 = 0.50;
const PEG_HEIGHT_M: f32 = 1.14;
const LIFTED_M: f32 = 0.10;
const STEADY_TILT_RAD: f32 = 35.0 * std::f32::consts::PI / 180.0;
const STEADY_M_S: f32 = 0.20;
const STEADY_RAD_S: f32 = 0.80;

pub const TASK: Task = Task {
    id: "frame_hang",
    scene: "gallery_136",
    robots: &[
        RobotSpot {
            name: "A",
            position_m: [-0.32, 0.0],
            yaw_rad: FRAC_PI_2,
            instruction: "Take the left side of the frame with your left hand. Lift it level with your partner, bring the \
                          brass loop on its top over the peg in the wall, lower it until it hangs, and let go.",
        },
        RobotSpot {
            name: "B",
            position_m: [0.32, 0.0],
            yaw_rad: FRAC_PI_2,
            instruction: "Take the right side of the frame with your right hand. Lift it level with your partner, bring the \
                          brass loop on its top over the peg in the wall, lower it until it hangs, and let go.",
        },
    ],
    objects: &[
        spot("frame", [0.0, FRAME_Y_M, 0.0]),
        spot("frame_rack", [0.0, FRAME_Y_M, 0.0]),
        spot("wall_peg", [0.0, WALL_Y_M, PEG_HEIGHT_M]),
    ],
    randomize: &[
        Offset { on_wall: true, ..uniform_xy(&["frame", "frame_rack", "wall_peg"], 0.05, 0.025) },
        Offset { z_m: -0.04..=0.0, ..uniform_xy(&["wall_peg"], 0.0, 0.0) },
        Offset { wider_yaw_rad: 0.05, ..uniform_xy(&["frame", "frame_rack"], 0.03, 0.01) },
    ],
    instruction: "Both robots lift the picture frame by its sides, hang it by its loop on the peg in the wall, and let go \
                  once it hangs.",
    benchmark_steps: 1000,
    phases: &[
        Phase {
            id: "grasp",
            description: "Both robots hold the frame.",
            collaborative: false,
            done: Done::When(&held_by_both),
            nearness: &|f| grips(f, &[A, B], "frame"),
        },
        Phase {
            id: "lift",
            description: "Both robots hold the frame at least 10 cm above where it stood.",
            collaborative: true,
            done: Done::When(&lifted),
            nearness: &|f| in_hands(grips(f, &[A, B], "frame"), &[come(f.lift_m("frame"), 0.0, LIFTED_M)]),
        },
        Phase {
            id: "hang",
            description: "The peg has passed through the loop while both robots held the frame; the frame has stayed on it, \
                          hangs within 35 degrees of upright and nearly still, and no robot has touched it for 0.2 s.",
            collaborative: true,
            done: Done::Sequence { first: &threaded_while_held, then: &hangs, broken: &off_the_peg },
            nearness: &|f| all(&[come(from_peg_m(f), 0.5, 0.0), is(threaded(f)), is(hangs(f))]),
        },
    ],
    file: None,
};

fn held_by_both(f: &Facts) -> bool {
    f.holds_any(A, "frame") && f.holds_any(B, "frame")
}

/// Both robots hold the frame in the air.
fn lifted(f: &Facts) -> bool {
    held_by_both(f) && f.lift_m("frame") >= LIFTED_M
}

fn threaded(f: &Facts) -> bool {
    f.threads("wall_peg", ["root", "tip"], "frame", "loop")
}

/// From the loop to the tip of the peg.
fn from_peg_m(f: &Facts) -> f32 {
    (f.site_m("frame", "loop") - f.site_m("wall_peg", "tip")).length()
}

fn threaded_while_held(f: &Facts) -> bool {
    threaded(f) && held_by_both(f)
}

fn off_the_peg(f: &Facts) -> bool {
    !threaded(f)
}

/// The frame hangs on the peg, released.
fn hangs(f: &Facts) -> bool {
    threaded(f)
        && f.untouched_s("frame") >= RELEASE_S
        && f.tilt_rad("frame") <= STEADY_TILT_RAD
        && f.speed_m_s("frame") <= STEADY_M_S
        && f.turn_rate_rad_s("frame") <= STEADY_RAD_S
}

#[cfg(test)]
mod tests;
