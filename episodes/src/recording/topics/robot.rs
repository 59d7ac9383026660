//! The topics of one robot: joint states, commands, hand forces and camera images.

use foxglove::messages::{CameraCalibration, CompressedImage, JointState, JointStates};
use tandem_sim::render::{CameraModel, Distortion, Intrinsics};
use tandem_sim::{MotorSetpoints, RobotCommand, RobotModel, RobotSensed, RobotStep};

use super::messages::{ActionMessage, BaseCommandMessage, HandsMessage, Json, SetpointsMessage};
use super::transforms::{EGOCENTRIC, robot_frame, rounded, timestamp};
use crate::commands::{RobotSheet, action_row};
use crate::observation::Picture;
use crate::output::OutputError;
use crate::recording::mcap_file::{McapFile, Topic};
use crate::scoring::Facts;

/// Binary digits of joint angles (8 urad), velocities (0.1 mrad/s) and torques (1 mN m).
const ANGLE_DIGITS: u8 = 17;
const SPEED_DIGITS: u8 = 13;
const EFFORT_DIGITS: u8 = 10;

/// The topics of one robot.
pub struct RobotTopics {
    joint_states: Topic<JointStates>,
    action: Topic<Json<ActionMessage>>,
    /// Executed commands, if they may differ from the policy's; `None` otherwise.
    executed: Option<Topic<Json<ActionMessage>>>,
    base_command: Topic<Json<BaseCommandMessage>>,
    hands: Topic<Json<HandsMessage>>,
    /// Setpoints of motors; opened by the first ones.
    setpoints: Option<Topic<Json<SetpointsMessage>>>,
    /// Intrinsics of its camera.
    lens: Intrinsics,
    /// Opened by the first image.
    camera: Option<CameraTopics>,
}

struct CameraTopics {
    image: Topic<CompressedImage>,
    calibration: Topic<CameraCalibration>,
    /// Time of the last image.
    last_s: f64,
}

impl RobotTopics {
    pub fn open(
        file: &mut McapFile,
        robot: &RobotSheet,
        camera: CameraModel,
        executes_otherwise: bool,
    ) -> Result<RobotTopics, OutputError> {
        let columns = action_row(&robot.model).join(",");
        let mut executed =
            || file.topic(&format!("/{}/executed_action", robot.name), &[("columns", &columns)]);
        let executed = executes_otherwise.then(&mut executed).transpose()?;
        Ok(RobotTopics {
            joint_states: file.topic(&format!("/{}/joint_states", robot.name), &[])?,
            action: file.topic(&format!("/{}/action", robot.name), &[("columns", &columns)])?,
            base_command: file.topic(&format!("/{}/base_command", robot.name), &[])?,
            hands: file.topic(&format!("/{}/hands", robot.name), &[])?,
            executed,
            setpoints: None,
            lens: Intrinsics::from(&robot.model.egocentric).of_model(camera),
            camera: None,
        })
    }

    /// Appends the control step of robot number `index`, described by `robot`, that ended at `time_s`.
    pub fn step(
        &mut self,
        file: &mut McapFile,
        robot: &RobotSheet,
        index: usize,
        time_s: f64,
        step: &RobotStep,
        facts: &Facts,
    ) -> Result<(), OutputError> {
        let joints = joint_states(&robot.model, time_s, &step.sensed);
        file.write(&mut self.joint_states, time_s, &joints)?;
        file.write(&mut self.action, time_s, &Json::from(&step.command))?;
        file.write(&mut self.base_command, time_s, &Json::from(&step.command))?;
        file.write(&mut self.hands, time_s, &HandsMessage::of(step, index, facts))
    }

    /// Appends the command that the robot executed in the control step that ended at `time_s`, if executed
    /// commands have a topic.
    pub fn executed(
        &mut self,
        file: &mut McapFile,
        time_s: f64,
        command: &RobotCommand,
    ) -> Result<(), OutputError> {
        match &mut self.executed {
            Some(topic) => file.write(topic, time_s, &Json::from(command)),
            None => Ok(()),
        }
    }

    /// Appends the setpoints of the motors of the robot called `name` in the control step that ended at
    /// `time_s`.
    pub fn setpoints(
        &mut self,
        file: &mut McapFile,
        name: &str,
        time_s: f64,
        setpoints: &[MotorSetpoints],
    ) -> Result<(), OutputError> {
        let topic = match &mut self.setpoints {
            Some(topic) => topic,
            unopened => unopened.insert(file.topic(&setpoints_topic(name), &[])?),
        };
        file.write(topic, time_s, &Json::from(setpoints))
    }

    /// Appends an image from the robot's head camera, unless an image of the same moment has been appended.
    /// Between commands the simulation pauses, so images do not change.
    pub fn picture(
        &mut self,
        file: &mut McapFile,
        robot: &RobotSheet,
        time_s: f64,
        picture: &Picture,
    ) -> Result<(), OutputError> {
        let name = &robot.name;
        let frame_id = robot_frame(name, EGOCENTRIC);
        let camera = match &mut self.camera {
            Some(camera) if camera.last_s == time_s => return Ok(()),
            Some(camera) => camera,
            unopened => {
                let mut camera = CameraTopics {
                    image: file.topic(&format!("/{name}/egocentric"), &[])?,
                    calibration: file.topic(&format!("/{name}/egocentric/calibration"), &[])?,
                    last_s: time_s,
                };
                let calibration = calibration(&self.lens, &frame_id, time_s);
                file.write(&mut camera.calibration, time_s, &calibration)?;
                unopened.insert(camera)
            }
        };
        camera.last_s = time_s;
        let png = picture.png().map_err(|source| OutputError::Encode(source.into()))?;
        let image = CompressedImage {
            timestamp: Some(timestamp(time_s)),
            frame_id,
            data: png.to_vec().into(),
            format: "png".into(),
        };
        file.write(&mut camera.image, time_s, &image)
    }
}

/// Returns the topic of the setpoints of a robot's motors.
pub fn setpoints_topic(robot: &str) -> String {
    format!("/{robot}/motor_setpoints")
}

fn joint_states(model: &RobotModel, time_s: f64, sensed: &RobotSensed) -> JointStates {
    let joints = model.joints.iter().enumerate().map(|(index, joint)| JointState {
        name: joint.name.clone(),
        position: Some(rounded(sensed.joints.q_rad[index], ANGLE_DIGITS)),
        velocity: Some(rounded(sensed.joints.qd_rad_s[index], SPEED_DIGITS)),
        acceleration: None,
        effort: Some(rounded(sensed.joints.torque_n_m[index], EFFORT_DIGITS)),
    });
    JointStates { timestamp: Some(timestamp(time_s)), joints: joints.collect() }
}

fn calibration(lens: &Intrinsics, frame_id: &str, time_s: f64) -> CameraCalibration {
    let Intrinsics { width, height, focal_px, cx, cy, distortion } = *lens;
    let Distortion { k1, k2, p1, p2 } = distortion;
    let (distortion_model, d) = match distortion == Distortion::NONE {
        true => Default::default(),
        false => ("plumb_bob".into(), [k1, k2, p1, p2, 0.0].map(f64::from).to_vec()),
    };
    let [focal_px, cx, cy] = [focal_px, cx, cy].map(f64::from);
    #[rustfmt::skip]
    let (k, p) = (
        vec![focal_px, 0.0, cx,  0.0, focal_px, cy,  0.0, 0.0, 1.0],
        vec![focal_px, 0.0, cx, 0.0,  0.0, focal_px, cy, 0.0,  0.0, 0.0, 1.0, 0.0],
    );
    CameraCalibration {
        timestamp: Some(timestamp(time_s)),
        frame_id: frame_id.into(),
        width,
        height,
        distortion_model,
        d,
        k,
        p,
        ..CameraCalibration::default()
    }
}
