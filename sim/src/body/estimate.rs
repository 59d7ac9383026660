//! Kinematic and static quantities of one robot at one instant, in the world frame.

use std::cell::OnceCell;
use std::sync::Arc;

use rapier3d::math::{Pose, Vector};

use super::{JOINTS, RobotModel, SiteModel, WAIST_JOINTS};
use crate::{GRAVITY_M_S2, Side, Sides};

/// A robot's estimate of its own body: joint readings, link poses, centre of mass. A controller may use
/// nothing else. All poses are in the robot's estimate of the world frame.
pub struct BodyEstimate {
    pub model: Arc<RobotModel>,
    pub q_rad: [f32; JOINTS],
    pub qd_rad_s: [f32; JOINTS],
    pub world_from_link: Vec<Pose>,
    pub pelvis_velocity_m_s: Vector,
    pub pelvis_angular_velocity_rad_s: Vector,
    pub com_m: Vector,
    pub com_velocity_m_s: Vector,
    /// Velocity of the middle of each palm.
    pub palm_velocity_m_s: Sides<Vector>,
    /// Load of each arm on the trunk, as a force at the arm's palm: the external force on the hand, and the
    /// inertial force of the moving arm.
    pub hand_reaction_n: Sides<Vector>,
    /// True if both thumb and fingers of the hand press on an object.
    pub hand_holds: Sides<bool>,
    /// True if thumb or fingers of the hand press on an object.
    pub hand_presses: Sides<bool>,
    /// True if arms or fingers are commanded to move.
    pub arms_told: bool,
    /// Waist targets of the task: yaw, roll, pitch.
    pub waist_target_rad: [f32; WAIST_JOINTS],
    /// Derived quantities, computed on first use.
    pub(crate) known: KnownOfBody,
}

#[derive(Default)]
pub(crate) struct KnownOfBody {
    link_motions: OnceCell<Vec<LinkMotion>>,
    gravity_n_m: OnceCell<[f32; JOINTS]>,
}

/// Pose and velocity of a pelvis.
pub(crate) struct PelvisMotion {
    pub world_from_pelvis: Pose,
    pub velocity_m_s: Vector,
    pub spin_rad_s: Vector,
}

/// Velocity of a link's origin, and angular velocity, in world axes.
#[derive(Clone, Copy)]
pub(crate) struct LinkMotion {
    pub velocity_m_s: Vector,
    pub spin_rad_s: Vector,
}

impl LinkMotion {
    /// Computes the motions of all links, outwards from the pelvis: with o the origin of a link, a the
    /// axis of its joint and p its parent,
    ///   w = w_p + a qd,   v = v_p + w_p x (o - o_p).
    fn of_links(
        model: &RobotModel,
        pelvis: LinkMotion,
        qd_rad_s: &[f32; JOINTS],
        world_from_link: &[Pose],
    ) -> Vec<LinkMotion> {
        let mut motions: Vec<LinkMotion> = Vec::with_capacity(model.links.len());
        for (link, world) in model.links.iter().zip(world_from_link) {
            let motion = match (link.parent, link.joint) {
                (Some(parent), Some(joint)) => {
                    let LinkMotion { velocity_m_s, spin_rad_s } = motions[parent];
                    let offset_m = world.translation - world_from_link[parent].translation;
                    let turning_rad_s = world.rotation * model.joints[joint].axis * qd_rad_s[joint];
                    LinkMotion {
                        velocity_m_s: velocity_m_s + spin_rad_s.cross(offset_m),
                        spin_rad_s: spin_rad_s + turning_rad_s,
                    }
                }
                _ => pelvis,
            };
            motions.push(motion);
        }
        motions
    }
}

impl BodyEstimate {
    /// Creates the estimate from joints, pelvis and the resulting link poses, for empty hands.
    pub(crate) fn of_motion(
        model: &Arc<RobotModel>,
        pelvis: &PelvisMotion,
        q_rad: &[f32; JOINTS],
        qd_rad_s: &[f32; JOINTS],
        world_from_link: Vec<Pose>,
    ) -> BodyEstimate {
        let moving = LinkMotion { velocity_m_s: pelvis.velocity_m_s, spin_rad_s: pelvis.spin_rad_s };
        let motions = LinkMotion::of_links(model, moving, qd_rad_s, &world_from_link);
        let (mut com_m, mut com_velocity_m_s) = (Vector::ZERO, Vector::ZERO);
        for ((link, world), motion) in model.links.iter().zip(&world_from_link).zip(&motions) {
            let LinkMotion { velocity_m_s, spin_rad_s } = *motion;
            let centre_m = world.rotation * link.mass.local_com;
            com_m += (world.translation + centre_m) * link.mass.mass();
            com_velocity_m_s += (velocity_m_s + spin_rad_s.cross(centre_m)) * link.mass.mass();
        }
        let palm_velocity_m_s = model.hands.each_ref().map(|hand| {
            let LinkMotion { velocity_m_s, spin_rad_s } = motions[hand.wrist];
            velocity_m_s + spin_rad_s.cross(world_from_link[hand.wrist].rotation * hand.palm_in_wrist_m)
        });
        BodyEstimate {
            model: Arc::clone(model),
            q_rad: *q_rad,
            qd_rad_s: *qd_rad_s,
            world_from_link,
            pelvis_velocity_m_s: pelvis.velocity_m_s,
            pelvis_angular_velocity_rad_s: pelvis.spin_rad_s,
            com_m: com_m / model.mass_kg,
            com_velocity_m_s: com_velocity_m_s / model.mass_kg,
            palm_velocity_m_s,
            hand_reaction_n: Sides::both(Vector::ZERO),
            hand_holds: Sides::both(false),
            hand_presses: Sides::both(false),
            arms_told: false,
            waist_target_rad: [0.0; WAIST_JOINTS],
            known: KnownOfBody { link_motions: motions.into(), ..KnownOfBody::default() },
        }
    }

    /// Returns the motions of all links.
    pub(crate) fn link_motions(&self) -> &[LinkMotion] {
        let pelvis = LinkMotion {
            velocity_m_s: self.pelvis_velocity_m_s,
            spin_rad_s: self.pelvis_angular_velocity_rad_s,
        };
        let of_links = || LinkMotion::of_links(&self.model, pelvis, &self.qd_rad_s, &self.world_from_link);
        self.known.link_motions.get_or_init(of_links)
    }

    /// Returns the middle of each palm, where loads of the hands are assumed to act.
    pub fn palms_m(&self) -> Sides<Vector> {
        self.model.hands.each_ref().map(|hand| self.world_from_link[hand.wrist] * hand.palm_in_wrist_m)
    }

    pub fn world_from_pelvis(&self) -> Pose {
        self.world_from_link[0]
    }

    pub fn world_from_site(&self, site: &SiteModel) -> Pose {
        self.world_from_link[site.link] * site.link_from_site
    }

    /// Returns the poses of the soles' centres.
    pub fn world_from_soles(&self) -> Sides<Pose> {
        self.model.soles.each_ref().map(|sole| self.world_from_site(sole))
    }

    /// Returns the pose of the foot: the last link of a leg, to which the sole belongs.
    pub fn world_from_foot(&self, side: Side) -> Pose {
        self.world_from_link[self.model.soles[side].link]
    }

    /// Returns the origin and the unit axis of a joint in the world.
    pub fn joint_axis(&self, joint: usize) -> (Vector, Vector) {
        let joint = &self.model.joints[joint];
        let world = self.world_from_link[joint.link];
        (world.translation, world.rotation * joint.axis)
    }

    /// Returns the torques that hold the links against gravity, pelvis fixed: tau_j = -a_j . (r_j x m_j
    /// g), with m_j and r_j the mass beyond joint j and its centre relative to the joint.
    pub fn gravity_torques_n_m(&self) -> [f32; JOINTS] {
        *self.known.gravity_n_m.get_or_init(|| self.torques_against_gravity_n_m())
    }

    fn torques_against_gravity_n_m(&self) -> [f32; JOINTS] {
        let links = self.model.links.len();
        let mut mass_kg = vec![0.0; links];
        let mut moment = vec![Vector::ZERO; links];
        for index in (0..links).rev() {
            let link = &self.model.links[index];
            mass_kg[index] += link.mass.mass();
            moment[index] += self.world_from_link[index] * link.mass.local_com * link.mass.mass();
            if let Some(parent) = link.parent {
                mass_kg[parent] += mass_kg[index];
                let beyond = moment[index];
                moment[parent] += beyond;
            }
        }
        let gravity = Vector::new(0.0, 0.0, -GRAVITY_M_S2);
        std::array::from_fn(|joint| {
            let (origin, axis) = self.joint_axis(joint);
            let link = self.model.joints[joint].link;
            -axis.dot((moment[link] - origin * mass_kg[link]).cross(gravity))
        })
    }

    /// Returns the moment of a force at a point about a joint's axis: one column of J^T f.
    pub fn moment_n_m(&self, joint: usize, point_m: Vector, force_n: Vector) -> f32 {
        let (origin, axis) = self.joint_axis(joint);
        axis.dot((point_m - origin).cross(force_n))
    }
}
