//! What a robot senses of itself, and its camera's calibration, as replies have them.

use tandem_sim::render::Intrinsics;
use tandem_sim::{BaseCommand, RobotSensed, RobotStep, Step};
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

/// One robot's share of a step, as far as the robot itself knows of it.
pub struct Proprioception<'a> {
    pub time_s: f64,
    pub sensed: &'a RobotSensed,
    /// The base command in force.
    pub base: &'a BaseCommand,
    /// The simulator's word, and no reading.
    pub fallen: bool,
}

impl<'a> Proprioception<'a> {
    /// Takes from `step` what robot number `robot` knows.
    pub fn of(step: &'a Step, robot: usize) -> Proprioception<'a> {
        let RobotStep { sensed, truth, command, .. } = &step.robots[robot];
        Proprioception { time_s: step.time_s, sensed, base: &command.base, fallen: truth.fallen }
    }
}

/// What a robot senses that is described by `sheet`.
pub fn robot_state(own: &Proprioception, sheet: &RobotSheet, detail: Detail) -> RobotState {
    let Proprioception { time_s, sensed, base, fallen } = *own;
    let named = |values: &[f32]| {
        let joints = sheet.model.joints.iter().zip(values);
        JointValues(joints.map(|(joint, value)| (joint.name.clone(), f64::from(*value))).collect())
    };
    let in_full = |values: &[f32]| (detail == Detail::Full).then(|| named(values));
    RobotState {
        robot: sheet.name.clone(),
        time_s,
        joint_positions_rad: named(&sensed.joints.q_rad),
        joint_velocities_rad_s: in_full(&sensed.joints.qd_rad_s),
        joint_torques_n_m: in_full(&sensed.joints.torque_n_m),
        left_wrist: wire_pose_from_sim(&sensed.pelvis_from_wrist.left),
        right_wrist: wire_pose_from_sim(&sensed.pelvis_from_wrist.right),
        gravity_in_pelvis: Some(wire_vector(sensed.gravity_in_pelvis)),
        pelvis_in_start: Some(wire_pose_from_sim(&sensed.start_from_pelvis)),
        base_command: wire_base(base),
        fallen: Some(fallen),
    }
}

/// The calibration of the camera in the head of the robot called `name`, with its `intrinsics`.
pub fn calibration(sensed: &RobotSensed, name: &str, intrinsics: &Intrinsics) -> CameraCalibration {
    let Intrinsics { width, height, focal_px, cx, cy } = *intrinsics;
    let focal_px = rounded(focal_px.into());
    CameraCalibration {
        robot: name.into(),
        width,
        height,
        fx: focal_px,
        fy: focal_px,
        cx: cx.into(),
        cy: cy.into(),
        camera_in_pelvis: wire_pose_from_sim(&opencv_axes(&sensed.pelvis_from_camera)),
    }
}
