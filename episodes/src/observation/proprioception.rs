//! What a robot senses of itself, and its camera's calibration, as replies have them.

use tandem_sim::render::{Camera, Intrinsics};
use tandem_sim::{Step, Vector};
use tandem_tools_spec::{CameraCalibration, JointValues, Observe, RobotState};

use crate::commands::RobotSheet;
use crate::convert::{opencv_axes, rounded, wire_base, wire_pose_from_sim, wire_vector};

/// How much of a state is told.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    Full,
    /// Neither velocities nor torques.
    Short,
}

impl Detail {
    pub fn of(args: &Observe) -> Detail {
        if args.short == Some(true) { Detail::Short } else { Detail::Full }
    }
}

/// What robot number `robot`, described by `sheet`, measures after `step`.
pub fn robot_state(step: &Step, robot: usize, sheet: &RobotSheet, detail: Detail) -> RobotState {
    let (state, command) = (&step.robots[robot].state, &step.robots[robot].command);
    let named = |values: &[f32]| {
        let joints = sheet.model.joints.iter().zip(values);
        JointValues(joints.map(|(joint, value)| (joint.name.clone(), f64::from(*value))).collect())
    };
    let in_full = |values: &[f32]| (detail == Detail::Full).then(|| named(values));
    let down = state.world_from_pelvis.rotation.inverse() * Vector::new(0.0, 0.0, -1.0);
    RobotState {
        robot: sheet.name.clone(),
        time_s: step.time_s,
        joint_positions_rad: named(&state.q_rad),
        joint_velocities_rad_s: in_full(&state.qd_rad_s),
        joint_torques_n_m: in_full(&state.torque_n_m),
        left_wrist: wire_pose_from_sim(&state.pelvis_from_wrist.left),
        right_wrist: wire_pose_from_sim(&state.pelvis_from_wrist.right),
        gravity_in_pelvis: wire_vector(down),
        pelvis_in_start: wire_pose_from_sim(&state.start_from_pelvis),
        base_command: wire_base(&command.base),
        fallen: state.fallen,
    }
}

/// The calibration of the camera in the head of robot number `robot`, called `name`, after `step`.
pub fn calibration(step: &Step, robot: usize, name: &str, camera: &Camera) -> CameraCalibration {
    let Intrinsics { width, height, focal_px, cx, cy } = camera.intrinsics();
    let focal_px = rounded(focal_px.into());
    CameraCalibration {
        robot: name.into(),
        width,
        height,
        fx: focal_px,
        fy: focal_px,
        cx: cx.into(),
        cy: cy.into(),
        camera_in_pelvis: wire_pose_from_sim(&opencv_axes(&step.robots[robot].state.pelvis_from_camera)),
    }
}
