//! A robot as described by its MJCF file: links, joints with gains and limits, sites, cameras, self-collision
//! pairs.

mod description;
mod draft;
mod feet;
mod fitted;
mod joints;
mod limits;
mod read;
mod scale;
mod source;
mod stance;

use std::collections::BTreeSet;

use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::prelude::MassProperties;

use crate::body::layout::{ARM_JOINTS, ARMS, LEG_JOINTS, LEGS, WAIST, WAIST_JOINTS};
use crate::mechanism::Solid;
use crate::mjcf::{Geom, MjcfCamera};
use crate::{Side, Sides};
pub use draft::RobotDraft;
pub use scale::BodyScale;
pub use source::RobotSource;

/// One rigid link. Bodies without a joint are merged into their parent's link.
#[derive(Clone, Debug)]
pub struct LinkModel {
    pub name: String,
    pub parent: Option<usize>,
    /// Joint origin in the parent link's frame, at joint coordinate 0.
    pub parent_from_link: Pose,
    /// Index into [`RobotModel::joints`]; `None` for the pelvis.
    pub joint: Option<usize>,
    pub mass: MassProperties,
    pub geoms: Vec<Geom>,
    solid: Solid,
}

/// One actuated hinge, with the PD gains and limits of its position actuator. A joint of the published order
/// that the robot lacks is rigid: its coordinate is 0 and its axis is zero, so that no force has a moment
/// about it.
#[derive(Clone, Debug)]
pub struct JointModel {
    pub name: String,
    /// Link that the joint moves; for a joint that the robot lacks, the link in which it would be.
    pub link: usize,
    /// The axis in the link's frame; zero for a joint that the robot lacks.
    pub axis: Vector,
    pub lower_rad: f32,
    pub upper_rad: f32,
    pub armature_kg_m2: f32,
    pub friction_n_m: f32,
    pub kp_n_m_rad: f32,
    pub kd_n_m_s_rad: f32,
    pub effort_n_m: f32,
    /// Speed at which the motor exerts no torque in the direction of motion; infinite if the file gives none.
    pub speed_limit_rad_s: f32,
    /// Coordinate in the file's first keyframe.
    pub rest_rad: f32,
}

impl JointModel {
    /// Returns true if the robot has this joint.
    pub fn exists(&self) -> bool {
        self.axis != Vector::ZERO
    }
}

/// A frame fixed to a link.
#[derive(Clone, Copy, Debug)]
pub struct SiteModel {
    pub link: usize,
    pub link_from_site: Pose,
}

/// A robot that can be added to a world any number of times.
#[derive(Clone, Debug)]
pub struct RobotModel {
    /// Parents before children; 0 is the pelvis.
    pub links: Vec<LinkModel>,
    /// Joints in published order.
    pub joints: Vec<JointModel>,
    /// Frames for which tasks give targets.
    pub wrists: Sides<SiteModel>,
    /// Centres of the soles.
    pub soles: Sides<SiteModel>,
    /// Points on which each foot can stand, in the frame of the link that carries the sole.
    pub sole_corners_m: Sides<Vec<Vector>>,
    /// Position of the inertial measurement unit: site `imu` of the pelvis, or the pelvis' own origin.
    pub imu_in_pelvis_m: Vector,
    pub egocentric: MjcfCamera,
    pub egocentric_link: usize,
    pub mass_kg: f32,
    /// Joints of each leg that the robot has, from the pelvis to the foot.
    pub leg_chains: Sides<Vec<usize>>,
    /// Size relative to the robot for which the base controller's parameters were tuned.
    pub scale: BodyScale,
    /// Link pairs that never touch, smaller index first.
    excluded: BTreeSet<(usize, usize)>,
    pub hands: Sides<HandLinks>,
    /// Elements of the file that only approximate MuJoCo.
    pub approximations: Vec<String>,
}

/// Links of one hand, for contact queries.
#[derive(Clone, Debug, Default)]
pub struct HandLinks {
    /// Link that carries palm and wrist.
    pub wrist: usize,
    /// Middle of the palm, where loads of the hand act, in the frame of the wrist's link.
    pub palm_in_wrist_m: Vector,
    pub thumb: Vec<usize>,
    pub fingers: Vec<usize>,
}

impl RobotModel {
    /// Returns the pairs of links that never touch.
    pub(crate) fn apart(&self) -> impl Iterator<Item = (usize, usize)> {
        self.excluded.iter().copied()
    }

    /// Returns the world poses of all links for a pelvis pose and joint coordinates in published order.
    pub fn forward_kinematics(&self, pelvis: Pose, q_rad: &[f32]) -> Vec<Pose> {
        let mut world_from_link: Vec<Pose> = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let pose = match (link.parent, link.joint) {
                (Some(parent), Some(joint)) => {
                    let turn = Rotation::from_axis_angle(self.joints[joint].axis, q_rad[joint]);
                    world_from_link[parent] * link.parent_from_link * Pose::from_rotation(turn)
                }
                _ => pelvis,
            };
            world_from_link.push(pose);
        }
        world_from_link
    }

    /// Returns the extent of the robot's colliding shapes along a world direction (a unit vector) from the
    /// world's origin, for these link poses.
    pub fn reach_m(&self, world_from_link: &[Pose], direction: Vector) -> f32 {
        let links = self.links.iter().zip(world_from_link);
        links.map(|(link, pose)| link.solid.reach_m(pose, direction)).fold(f32::NEG_INFINITY, f32::max)
    }

    /// Returns the joint of a leg's hip that is nearer to the foot: pitch or roll. The thigh turns about its
    /// origin.
    pub fn hip(&self, side: Side) -> usize {
        let [pitch, roll] = [LEGS[side], LEGS[side] + 1];
        if self.joints[pitch].link > self.joints[roll].link { pitch } else { roll }
    }

    /// Returns the first link of an arm, for any order of its joints; the pelvis if there is no arm.
    pub fn shoulder(&self, side: Side) -> usize {
        let arm = self.joints[ARMS[side]..][..ARM_JOINTS].iter().filter(|joint| joint.exists());
        arm.map(|joint| joint.link).min().unwrap_or_default()
    }

    /// Returns origin and direction of the axis about which a foot rolls if its ankle has no roll joint:
    /// along the middle of the sole. No motor acts about it. Returns `None` for an ankle that rolls.
    pub fn sole_axis(&self, side: Side, foot: Pose) -> Option<(Vector, Vector)> {
        let rolls = self.joints[LEGS[side] + LEG_JOINTS - 1].exists();
        (!rolls).then(|| (foot * self.soles[side].link_from_site.translation, foot.rotation * Vector::X))
    }

    /// Returns the link with this name in the embedded robot's file: the pelvis, the trunk above the
    /// waist, or the one that carries the joint of that name.
    pub fn published_link(&self, name: &str) -> Option<usize> {
        let joint = match name {
            "pelvis" => return Some(0),
            "torso_link" => return self.joints[WAIST..][..WAIST_JOINTS].iter().map(|joint| joint.link).max(),
            other => other.replace("_link", "_joint"),
        };
        self.joints.iter().find(|candidate| candidate.name == joint).map(|found| found.link)
    }

    /// Returns true if the robot has a hand that can close: a thumb, and a finger against it.
    pub fn has_fingers(&self) -> bool {
        self.hands.iter().any(|hand| !hand.thumb.is_empty() && !hand.fingers.is_empty())
    }

    pub(crate) fn rest_rad(&self) -> Vec<f32> {
        self.joints.iter().map(|joint| joint.rest_rad).collect()
    }
}
