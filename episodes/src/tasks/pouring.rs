//! Pouring: A tips a marble out of a small cup into a tall glass that B holds under it.
//!
//! Conditions, tolerances and randomisation are the benchmark's. Where it is silent we chose what two G1s reach without
//! stepping: they face each other over a table, the cup before A's right hand, the glass before B's.

use std::f32::consts::{FRAC_PI_3, FRAC_PI_6, PI};

use super::{Offset, RobotSpot, Task, spot, uniform_xy};
use crate::scoring::nearness::{all, beside, come, grips, in_hands, is};
use crate::scoring::{A, B, Done, Facts, Phase};

/// Height of the worktop above the floor.
const WORKTOP_M: f32 = 0.80;
const ALOFT_M: f32 = 0.03;
const TIPPED_RAD: f32 = FRAC_PI_3;
/// The marble's centre on the floor of the cup: 6 mm of base and its radius.
const MARBLE_M: f32 = WORKTOP_M + 0.0171;
const CUP_XY_M: [f32; 2] = [0.27, -0.10];

pub const TASK: Task = Task {
    id: "pouring",
    scene: "kitchen_085",
    robots: &[
        RobotSpot {
            name: "A",
            position_m: [0.0, 0.0],
            yaw_rad: 0.0,
            instruction: "A marble lies in the small cup in front of you. Take the cup around its wall with your right hand, \
                          lift it, bring it over the mouth of your partner's glass, and tip it until the marble falls in.",
        },
        RobotSpot {
            name: "B",
            position_m: [0.74, -0.12],
            yaw_rad: PI,
            instruction: "Take the tall glass in front of you around its wall with your right hand, lift it clear of the \
                          table, and hold it upright and still under your partner's cup until the marble lies in it.",
        },
    ],
    objects: &[
        spot("cup", [CUP_XY_M[0], CUP_XY_M[1], WORKTOP_M]),
        spot("glass", [0.47, -0.02, WORKTOP_M]),
        spot("marble", [CUP_XY_M[0], CUP_XY_M[1], MARBLE_M]),
    ],
    randomize: &[
        Offset { yaw_rad: -FRAC_PI_6..=FRAC_PI_6, ..uniform_xy(&["cup", "marble"], 0.03, 0.06) },
        Offset { yaw_rad: -FRAC_PI_6..=FRAC_PI_6, ..uniform_xy(&["glass"], 0.03, 0.06) },
        uniform_xy(&["marble"], 0.006, 0.006),
    ],
    instruction: "Both robots lift their vessels off the table; Robot A pours the marble from its cup into the glass that \
                  Robot B holds up.",
    benchmark_steps: 1000,
    phases: &[
        Phase {
            id: "lift_both_vessels",
            description: "Cup and glass are at least 3 cm above the worktop at the same time.",
            collaborative: false,
            done: Done::When(&both_aloft),
            nearness: &|f| {
                all(&[
                    in_hands(grips(f, &[A], "cup"), &[risen(f, "cup")]),
                    in_hands(grips(f, &[B], "glass"), &[risen(f, "glass")]),
                ])
            },
        },
        Phase {
            id: "tip",
            description: "A holds the cup aloft and tilts it by at least 60 degrees.",
            collaborative: false,
            done: Done::When(&tipped),
            nearness: &|f| {
                in_hands(grips(f, &[A], "cup"), &[risen(f, "cup"), come(f.tilt_rad("cup"), 0.0, TIPPED_RAD)])
            },
        },
        Phase {
            id: "pour",
            description: "The marble has been inside the glass for 0.5 s without a break, and the glass is at least 3 cm \
                          above the worktop.",
            collaborative: true,
            done: Done::Lasting { condition: &marble_in_glass, for_s: 0.5, at_end: &glass_aloft },
            nearness: &|f| {
                all(&[beside(f, "marble", "glass", [0.5, 0.02]), is(marble_in_glass(f)), risen(f, "glass")])
            },
        },
    ],
    file: None,
};

/// Cup and glass are off the worktop.
fn both_aloft(f: &Facts) -> bool {
    aloft(f, "cup") && aloft(f, "glass")
}

/// A holds the cup in the air, tilted.
fn tipped(f: &Facts) -> bool {
    f.holds_any(A, "cup") && aloft(f, "cup") && f.tilt_rad("cup") >= TIPPED_RAD
}

/// The marble's centre is between the walls of the glass.
fn marble_in_glass(f: &Facts) -> bool {
    f.inside_vessel("marble", "glass")
}

/// The glass is off the worktop.
fn glass_aloft(f: &Facts) -> bool {
    aloft(f, "glass")
}

/// How far a vessel has come off the worktop.
fn risen(f: &Facts, vessel: &str) -> f32 {
    come(f.clearance_m(vessel), 0.0, ALOFT_M)
}

/// All of a vessel is off the worktop, however it is tilted.
fn aloft(f: &Facts, vessel: &str) -> bool {
    f.clearance_m(vessel) >= ALOFT_M
}

#[cfg(test)]
mod tests;
