//! A robot as its MJCF file describes it: links, joints with gains and limits, sites, cameras, self-collision pairs.

mod read;

use std::collections::BTreeSet;

use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::prelude::MassProperties;

use crate::Sides;
use crate::mechanism::Solid;
use crate::mjcf::{Geom, MjcfCamera};

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

/// One actuated hinge, with the PD gains and limits of its position actuator.
#[derive(Clone, Debug)]
pub struct JointModel {
    pub name: String,
    pub link: usize,
    /// The axis in the link's frame.
    pub axis: Vector,
    pub lower_rad: f32,
    pub upper_rad: f32,
    pub armature_kg_m2: f32,
    pub friction_n_m: f32,
    pub kp_n_m_rad: f32,
    pub kd_n_m_s_rad: f32,
    pub effort_n_m: f32,
    /// At which its motor can push no further; infinite if the file does not say.
    pub speed_limit_rad_s: f32,
    /// Coordinate in the file's first keyframe.
    pub rest_rad: f32,
}

/// A frame fixed to a link.
#[derive(Clone, Copy, Debug)]
pub struct SiteModel {
    pub link: usize,
    pub link_from_site: Pose,
}

/// A robot that can be put into a world any number of times.
#[derive(Clone, Debug)]
pub struct RobotModel {
    /// Parents before children; 0 is the pelvis.
    pub links: Vec<LinkModel>,
    /// Published order: the file's actuators.
    pub joints: Vec<JointModel>,
    /// The frames that tasks put somewhere.
    pub wrists: Sides<SiteModel>,
    /// Centre of the sole.
    pub soles: Sides<SiteModel>,
    /// Points of the link that carries a sole on which it can stand, in that link's frame.
    pub sole_corners_m: Sides<Vec<Vector>>,
    /// Where the inertial measurement unit is: site `imu` of the pelvis, or the pelvis' own origin.
    pub imu_in_pelvis_m: Vector,
    pub egocentric: MjcfCamera,
    pub egocentric_link: usize,
    pub mass_kg: f32,
    /// Link pairs that never touch, smaller index first.
    excluded: BTreeSet<(usize, usize)>,
    pub hands: Sides<HandLinks>,
    /// What its file says that does not happen quite as in MuJoCo.
    pub approximations: Vec<String>,
}

/// Links of one hand, for contact queries.
#[derive(Clone, Debug, Default)]
pub struct HandLinks {
    /// Link that carries palm and wrist.
    pub wrist: usize,
    pub thumb: Vec<usize>,
    pub fingers: Vec<usize>,
}

impl RobotModel {
    /// Pairs of links that never touch.
    pub(crate) fn apart(&self) -> impl Iterator<Item = (usize, usize)> {
        self.excluded.iter().copied()
    }

    /// World poses of all links for a pelvis pose and joint coordinates in published order.
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

    /// How far what collides of the robot reaches along a direction of the world, a unit vector, from the world's origin, with
    /// its links at these poses.
    pub fn reach_m(&self, world_from_link: &[Pose], direction: Vector) -> f32 {
        let links = self.links.iter().zip(world_from_link);
        links.map(|(link, pose)| link.solid.reach_m(pose, direction)).fold(f32::NEG_INFINITY, f32::max)
    }

    pub(crate) fn rest_rad(&self) -> Vec<f32> {
        self.joints.iter().map(|joint| joint.rest_rad).collect()
    }
}
