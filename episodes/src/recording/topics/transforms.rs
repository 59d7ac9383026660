//! Poses as Foxglove's transforms: the world, each robot's chain of links, its camera, and the objects.

use foxglove::messages::{FrameTransform, FrameTransforms, Quaternion, Timestamp, Vector3};
use tandem_sim::{Pose, RobotModel, RobotSensed, Rotation, Step, Vector};

use crate::commands::RobotSheet;
use crate::convert::opencv_axes;
use crate::recording::mcap_file::time_ns;

/// Root frame of all others.
pub const WORLD: &str = "world";
/// Name of a robot's camera frame after the robot's own name.
pub const EGOCENTRIC: &str = "egocentric";

/// Binary digits of a position in m: 8 um.
const POSITION_DIGITS: u8 = 17;
/// Binary digits of a quaternion's parts: 2 urad.
const ROTATION_DIGITS: u8 = 20;

/// Returns the frame name of a robot's link or camera.
pub fn robot_frame(robot: &str, part: &str) -> String {
    format!("{robot}/{part}")
}

/// Returns all frames at one step.
pub fn transforms(robots: &[RobotSheet], step: &Step) -> FrameTransforms {
    let timestamp = timestamp(step.time_s);
    let frame = |parent: String, child: String, parent_from_child: Pose| FrameTransform {
        timestamp: Some(timestamp),
        parent_frame_id: parent,
        child_frame_id: child,
        translation: Some(rounded_vector3(parent_from_child.translation)),
        rotation: Some(rounded_quaternion(parent_from_child.rotation)),
    };
    let mut transforms = Vec::new();
    for (robot, moved) in robots.iter().zip(&step.robots) {
        let model = &robot.model;
        let name = |link: usize| robot_frame(&robot.name, &model.links[link].name);
        transforms.push(frame(WORLD.into(), name(0), moved.truth.world_from_pelvis()));
        for (link, parent_from_link) in link_poses(model, &moved.sensed) {
            let parent = model.links[link].parent.unwrap_or_default();
            transforms.push(frame(name(parent), name(link), parent_from_link));
        }
        let camera = robot_frame(&robot.name, EGOCENTRIC);
        transforms.push(frame(name(0), camera, opencv_axes(&moved.sensed.pelvis_from_camera)));
    }
    for object in &step.objects {
        transforms.push(frame(WORLD.into(), object.name.clone(), object.state.world_from_object));
    }
    FrameTransforms { transforms }
}

/// Returns the pose of every jointed link in its parent, from the measured joint angles: multibody joints
/// do not drift.
fn link_poses<'a>(
    model: &'a RobotModel,
    sensed: &'a RobotSensed,
) -> impl Iterator<Item = (usize, Pose)> + 'a {
    model.joints.iter().enumerate().map(|(index, joint)| {
        let turn = Rotation::from_axis_angle(joint.axis, sensed.joints.q_rad[index]);
        (joint.link, model.links[joint.link].parent_from_link * Pose::from_rotation(turn))
    })
}

/// Rounds a number for display to the nearest multiple of `2^-binary_digits`. Further digits compress badly,
/// and no sensor resolves them; steps hold every bit.
pub fn rounded(value: f32, binary_digits: u8) -> f64 {
    let ones = f64::from(1u32 << binary_digits);
    (f64::from(value) * ones).round() / ones
}

pub fn timestamp(time_s: f64) -> Timestamp {
    const NS_PER_S: u64 = 1_000_000_000;
    let ns = time_ns(time_s);
    Timestamp::new((ns / NS_PER_S) as u32, (ns % NS_PER_S) as u32)
}

fn rounded_vector3(value_m: Vector) -> Vector3 {
    let [x, y, z] = [value_m.x, value_m.y, value_m.z].map(|part| rounded(part, POSITION_DIGITS));
    Vector3 { x, y, z }
}

fn rounded_quaternion(q: Rotation) -> Quaternion {
    let [x, y, z, w] = [q.x, q.y, q.z, q.w].map(|part| rounded(part, ROTATION_DIGITS));
    Quaternion { x, y, z, w }
}

pub fn vector3(value: Vector) -> Vector3 {
    Vector3 { x: value.x.into(), y: value.y.into(), z: value.z.into() }
}

pub fn quaternion(q: Rotation) -> Quaternion {
    Quaternion { x: q.x.into(), y: q.y.into(), z: q.z.into(), w: q.w.into() }
}
