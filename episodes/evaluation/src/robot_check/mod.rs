//! A first check of a robot's file: the parts that it has, and standing for one second. The module also
//! drafts descriptions of robots.

mod stand;

use std::path::Path;

use tandem_episodes::{RobotError, RobotFile};
use tandem_sim::{RobotDraft, RobotModel, Side, SimError};

use stand::stand;

/// Findings about a robot whose file was read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotCheck {
    /// Parts that the robot lacks, with the consequences.
    pub lacks: Vec<String>,
    /// Reason why the robot does not stand for a second; `None` if it does.
    pub falls: Option<String>,
}

/// Maximum displacement of a standing G1's pelvis in one second.
const MAX_MOVED_M: f32 = 0.1;

/// Checks a robot, and simulates one second of standing.
///
/// # Errors
///
/// Returns an error if the robot cannot be read, or its physics diverges.
pub fn check_robot(robot: &RobotFile) -> Result<RobotCheck, RobotError> {
    let model = robot.model()?;
    let trial = stand(&model)?;
    let moved = trial.moved_m > model.scale.length_m(MAX_MOVED_M);
    let limits: Vec<String> =
        trial.at_limit.iter().map(|(joint, effort_n_m)| format!("{joint} ({effort_n_m} N m)")).collect();
    let falls = (trial.fallen || moved).then(|| {
        let how =
            if trial.fallen { "it falls".into() } else { format!("it moves by {:.2} m", trial.moved_m) };
        let why = match limits.is_empty() {
            true => {
                "its joints are not at their limits of effort; look at soles, rest angles and masses".into()
            }
            false => format!("at their limits of effort are {}", limits.join(", ")),
        };
        format!("it cannot stand: {how} within a second without commands; {why}")
    });
    Ok(RobotCheck { lacks: lacks(&model), falls })
}

/// Returns the parts that a robot lacks, with the consequences.
fn lacks(model: &RobotModel) -> Vec<String> {
    let count = |parts: &[&str], side: Side| {
        let joints = model.joints.iter().filter(|joint| joint.exists());
        joints
            .filter(|joint| {
                parts.iter().any(|part| joint.name.starts_with(&format!("{}_{part}", side.name())))
            })
            .count()
    };
    let arms = Side::BOTH.map(|side| count(&["shoulder", "elbow", "wrist"], side));
    let mut lacks = Vec::new();
    match arms {
        [0, 0] => lacks.push(
            "it has no arms: move_wrists and the arms' columns of send_joint_chunk do nothing, and check_reach reports the wrists where they are".to_string(),
        ),
        [left, right] if left.min(right) < 6 => lacks.push(format!(
            "its arms have {left} and {right} joints: move_wrists brings a wrist to a place and turns it as far as they can; six turn it freely"
        )),
        _ => {}
    }
    if !model.has_fingers() {
        lacks.push("it has no hands that close: fingers' targets do nothing, and tasks that need a grasp are refused".into());
    }
    lacks
}

/// Drafts the description for an MJCF file, to which the description refers as `model_name`.
///
/// # Errors
///
/// Returns an error if the file cannot be read, or has no bodies.
pub fn draft_robot(path: &Path, model_name: &str) -> Result<RobotDraft, SimError> {
    RobotDraft::of(path, model_name)
}
