//! Proprioception of a robot, and its camera's calibration, in the form of replies.

use nalgebra::Isometry3;
use tandem_sim::render::Intrinsics;
use tandem_sim::{BaseCommand, JOINTS, Pose, RobotSensed, RobotStep, SensorReadings, Step, Vector};
use tandem_tools_spec::{CameraCalibration, JointValues, Observe, PoseFrame, RobotState, SensorSamples};

use super::RobotObservation;
use crate::commands::RobotSheet;
use crate::convert::{
    isometry_from_sim, opencv_axes, rounded, rounded_to, wire_base, wire_distortion, wire_pose,
    wire_pose_from_sim, wire_vector,
};

/// Level of detail of a state.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    Full,
    /// Without joints.
    Short,
}

impl Detail {
    pub fn of(args: &Observe) -> Detail {
        if args.short == Some(true) { Detail::Short } else { Detail::Full }
    }
}

/// Proprioceptive part of a step, for one robot.
pub struct Proprioception<'a> {
    pub time_s: f64,
    pub sensed: &'a RobotSensed,
    /// Current base command.
    pub base: &'a BaseCommand,
    /// True if the robot has fallen. Taken from the simulator, not from a sensor.
    pub fallen: bool,
}

impl<'a> Proprioception<'a> {
    /// Returns the proprioception of robot number `robot` in `step`.
    pub fn of(step: &'a Step, robot: usize) -> Proprioception<'a> {
        let RobotStep { sensed, truth, command, .. } = &step.robots[robot];
        Proprioception { time_s: step.time_s, sensed, base: &command.base, fallen: truth.fallen }
    }
}

/// Returns the state of the robot described by `sheet`, without its wrist targets.
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
        frame: None,
        joint_positions_rad: in_full(&sensed.joints.q_rad).unwrap_or_default(),
        joint_velocities_rad_s: in_full(&sensed.joints.qd_rad_s),
        joint_torques_n_m: in_full(&sensed.joints.torque_n_m),
        left_wrist: wire_pose_from_sim(&sensed.pelvis_from_wrist.left),
        right_wrist: wire_pose_from_sim(&sensed.pelvis_from_wrist.right),
        left_wrist_target: None,
        right_wrist_target: None,
        gravity_in_pelvis: Some(wire_vector(sensed.gravity_in_pelvis)),
        pelvis_in_start: Some(wire_pose_from_sim(&sensed.start_from_pelvis)),
        pelvis_in_room: None,
        base_command: Some(wire_base(base)),
        fallen: Some(fallen),
        samples: None,
    }
}

/// Decimals of readings: 10 urad, and finer than a G1's sensors in every unit.
const READING_DECIMALS: i32 = 5;

/// Returns readings of a robot's sensors in the form of replies.
pub fn samples(readings: &[SensorReadings]) -> SensorSamples {
    let told = |value: f32| rounded_to(READING_DECIMALS, value.into());
    let joints = |of: fn(&SensorReadings) -> &[f32; JOINTS]| {
        readings.iter().map(|reading| of(reading).iter().copied().map(told).collect()).collect()
    };
    let vector = |of: fn(&SensorReadings) -> Vector| {
        readings.iter().map(|reading| of(reading).to_array().map(told)).collect()
    };
    SensorSamples {
        joint_positions_rad: joints(|reading| &reading.joints.q_rad),
        joint_velocities_rad_s: joints(|reading| &reading.joints.qd_rad_s),
        joint_torques_n_m: joints(|reading| &reading.joints.torque_n_m),
        gyro_rad_s: vector(|reading| reading.gyro_rad_s),
        specific_force_m_s2: vector(|reading| reading.specific_force_m_s2),
    }
}

/// Returns the calibration of the head camera with these `intrinsics` of the robot called `name`.
pub fn calibration(sensed: &RobotSensed, name: &str, intrinsics: &Intrinsics) -> CameraCalibration {
    let Intrinsics { width, height, focal_px, cx, cy, distortion } = *intrinsics;
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
        camera_in_frame: None,
        distortion: wire_distortion(&distortion),
    }
}

impl RobotObservation {
    /// Converts wrists and camera to `frame`, whose pose in the pelvis frame is `pelvis_from_frame`. The
    /// poses come from `sensed`.
    pub fn tell_in(&mut self, frame: PoseFrame, pelvis_from_frame: &Isometry3<f64>, sensed: &RobotSensed) {
        let pelvis_from_camera = isometry_from_sim(&opencv_axes(&sensed.pelvis_from_camera));
        self.calibration.camera_in_frame = Some(wire_pose(&pelvis_from_frame.inv_mul(&pelvis_from_camera)));
        tell_state_in(&mut self.state, frame, pelvis_from_frame, sensed);
    }
}

/// Converts the wrists of a state to `frame` like [`RobotObservation::tell_in`], and adds the pelvis in the
/// room.
pub fn tell_state_in(
    state: &mut RobotState,
    frame: PoseFrame,
    pelvis_from_frame: &Isometry3<f64>,
    sensed: &RobotSensed,
) {
    if frame == PoseFrame::Pelvis {
        return;
    }
    let in_frame =
        |pelvis_from: &Pose| wire_pose(&pelvis_from_frame.inv_mul(&isometry_from_sim(pelvis_from)));
    state.frame = Some(frame);
    state.left_wrist = in_frame(&sensed.pelvis_from_wrist.left);
    state.right_wrist = in_frame(&sensed.pelvis_from_wrist.right);
    state.pelvis_in_room = (frame == PoseFrame::Room).then(|| wire_pose(&pelvis_from_frame.inverse()));
}
