//! The G1 of the tests: pelvis fixed, waist and arms free, capsules about trunk, head, forearms and hands.

use nalgebra::Point3;
use tandem_ik::{Capsule, Configuration, Model, SelfCollision};

/// The whole robot's file.
pub const ROBOT: &str = include_str!("../../../sim/assets/robots/g1_dex3/robot.xml");
/// Elbows bent, hands in front.
pub const READY_RAD: [f64; 17] =
    [0.0, 0.0, 0.0, 0.2, 0.2, 0.0, 1.28, 0.0, 0.0, 0.0, 0.2, -0.2, 0.0, 1.28, 0.0, 0.0, 0.0];

/// Returns the model with waist (3), left arm (7) and right arm (7).
pub fn g1() -> Model {
    let whole = Model::from_mjcf(ROBOT).expect("the robot's file");
    let arm = [
        "shoulder_pitch",
        "shoulder_roll",
        "shoulder_yaw",
        "elbow",
        "wrist_roll",
        "wrist_pitch",
        "wrist_yaw",
    ];
    let mut free: Vec<String> =
        ["yaw", "roll", "pitch"].iter().map(|axis| format!("waist_{axis}_joint")).collect();
    for side in ["left", "right"] {
        free.extend(arm.iter().map(|part| format!("{side}_{part}_joint")));
    }
    let free: Vec<&str> = free.iter().map(String::as_str).collect();
    whole.reduced(&free, &vec![0.0; whole.nv()]).expect("joints of the robot")
}

/// Returns the robot at [`READY_RAD`].
pub fn ready(model: &Model) -> Configuration<'_> {
    Configuration::new(model, &READY_RAD).expect("17 numbers")
}

/// Returns ten pairs: both forearms and hands against the trunk, the head and each other.
pub fn self_collision(model: &Model) -> SelfCollision {
    let capsule = |link: &str, a: [f64; 3], b: [f64; 3], radius_m: f64| Capsule {
        frame: model.frame(link).expect("a link"),
        ends: [Point3::from(a), Point3::from(b)],
        radius_m,
    };
    let capsules = vec![
        capsule("torso_link", [0.0, 0.0, 0.08], [0.0, 0.0, 0.25], 0.10),
        capsule("torso_link", [0.0, 0.0, 0.43], [0.0, 0.0, 0.43], 0.10),
        capsule("left_elbow_link", [0.0; 3], [0.10, 0.0, -0.01], 0.035),
        capsule("left_wrist_yaw_link", [0.0; 3], [0.15, 0.0, 0.0], 0.045),
        capsule("right_elbow_link", [0.0; 3], [0.10, 0.0, -0.01], 0.035),
        capsule("right_wrist_yaw_link", [0.0; 3], [0.15, 0.0, 0.0], 0.045),
    ];
    let pairs = vec![[0, 2], [0, 3], [1, 3], [0, 4], [0, 5], [1, 5], [3, 5], [2, 5], [3, 4], [2, 4]];
    SelfCollision { capsules, pairs, margin_m: 0.005, range_m: 0.08, gain: 0.3 }
}
