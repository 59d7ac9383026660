//! A first trial of a robot: standing for one second.

use std::sync::Arc;

use tandem_sim::{RobotModel, RobotPlacement, SimError, World, WorldSpec};

/// Outcome of one second of standing.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StandTrial {
    pub fallen: bool,
    /// Maximum displacement of the pelvis from its start, in any direction.
    pub moved_m: f32,
    /// Leg joints that reached their effort limits, with these limits in N m.
    pub at_limit: Vec<(String, f32)>,
}

/// Number of control steps in the trial, which is one second.
const STEPS: u32 = 50;
/// Share of its effort limit from which a joint counts as at the limit.
const AT_LIMIT_SHARE: f32 = 0.98;

/// Simulates a robot that stands on a floor for one second without commands.
///
/// # Errors
///
/// Returns an error if the robot's physics diverges.
pub(super) fn stand(model: &Arc<RobotModel>) -> Result<StandTrial, SimError> {
    let placement = RobotPlacement { name: "A".into(), position_m: [0.0; 2], yaw_rad: 0.0 };
    let spec = WorldSpec { scene: "floor".into(), robots: vec![placement], objects: Vec::new() };
    let mut world = World::with_robot(&spec, model.clone())?;
    let command = world.rest_command(0);
    let start_m = world.present().robots[0].truth.world_from_pelvis().translation;
    let mut trial = StandTrial { fallen: false, moved_m: 0.0, at_limit: Vec::new() };
    for _ in 0..STEPS {
        let step = world.control_step(&[command])?;
        let robot = &step.robots[0];
        let legs = model.leg_chains.iter().flatten();
        for joint in legs {
            let (name, effort_n_m) = (&model.joints[*joint].name, model.joints[*joint].effort_n_m);
            let used = robot.sensed.joints.torque_n_m[*joint].abs() / effort_n_m;
            if used > AT_LIMIT_SHARE && trial.at_limit.iter().all(|(other, _)| other != name) {
                trial.at_limit.push((name.clone(), effort_n_m));
            }
        }
        let pelvis_m = robot.truth.world_from_pelvis().translation;
        trial.moved_m = trial.moved_m.max((pelvis_m - start_m).length());
        trial.fallen |= robot.truth.fallen;
    }
    Ok(trial)
}
