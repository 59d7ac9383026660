//! Inverse dynamics of one robot: the joint torques and the external wrench that a given motion requires.
//!
//! Newton-Euler in the world frame. Outwards, with r, a the origin and axis of a joint and p the parent link:
//!   w = w_p + a q',   dw = dw_p + a q'' + w_p x a q',   acc = acc_p + dw_p x r + w_p x (w_p x r).
//! Inwards: f = m (acc_c - g),  n = I dw + w x I w,  summed up to the pelvis;  tau = a . n + armature
//! q''. Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 5.

use rapier3d::math::Vector;

use super::{BodyEstimate, JOINTS};
use crate::GRAVITY_M_S2;

/// Acceleration of a link at its origin, world frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Acceleration {
    pub linear_m_s2: Vector,
    pub angular_rad_s2: Vector,
}

/// Torques, force and moment that a motion requires.
pub struct Effort {
    /// Torque on each joint, in published order.
    pub torque_n_m: [f32; JOINTS],
    /// External force on the whole robot besides gravity.
    pub force_n: Vector,
    /// Moment on the whole robot about the pelvis' origin.
    pub moment_n_m: Vector,
    /// Acceleration of each link, in the order of the model.
    pub links: Vec<Acceleration>,
}

/// Motion of a link, and the force and moment about its origin that it requires, gravity included.
struct Moving {
    spin_rad_s: Vector,
    acceleration: Acceleration,
    force_n: Vector,
    moment_n_m: Vector,
}

impl BodyEstimate {
    /// Returns the effort for an acceleration of the pelvis and of all joints (rad/s^2), at the measured
    /// positions and velocities.
    pub fn inverse_dynamics(&self, pelvis: Acceleration, qdd_rad_s2: &[f32; JOINTS]) -> Effort {
        let mut links: Vec<Moving> = Vec::with_capacity(self.model.links.len());
        for (index, link) in self.model.links.iter().enumerate() {
            let (spin_rad_s, acceleration) = match (link.parent, link.joint) {
                (Some(parent), Some(joint)) => {
                    let offset_m =
                        self.world_from_link[index].translation - self.world_from_link[parent].translation;
                    self.follow(&links[parent], offset_m, joint, qdd_rad_s2[joint])
                }
                _ => (self.pelvis_angular_velocity_rad_s, pelvis),
            };
            let (force_n, moment_n_m) = self.effort_of_link(index, spin_rad_s, acceleration);
            links.push(Moving { spin_rad_s, acceleration, force_n, moment_n_m });
        }
        let mut torque_n_m = [0.0; JOINTS];
        for (index, link) in self.model.links.iter().enumerate().rev() {
            let (Some(parent), Some(joint)) = (link.parent, link.joint) else { continue };
            let (force_n, moment_n_m) = (links[index].force_n, links[index].moment_n_m);
            let world = self.world_from_link[index];
            let model = &self.model.joints[joint];
            torque_n_m[joint] =
                (world.rotation * model.axis).dot(moment_n_m) + model.armature_kg_m2 * qdd_rad_s2[joint];
            let offset_m = world.translation - self.world_from_link[parent].translation;
            links[parent].force_n += force_n;
            links[parent].moment_n_m += moment_n_m + offset_m.cross(force_n);
        }
        let Moving { force_n, moment_n_m, .. } = links[0];
        Effort {
            torque_n_m,
            force_n,
            moment_n_m,
            links: links.into_iter().map(|link| link.acceleration).collect(),
        }
    }

    /// Returns the angular velocity and the acceleration of a link from those of its parent; `offset_m`
    /// is the vector from the parent's origin.
    fn follow(
        &self,
        parent: &Moving,
        offset_m: Vector,
        joint: usize,
        qdd_rad_s2: f32,
    ) -> (Vector, Acceleration) {
        let (_, axis) = self.joint_axis(joint);
        let along_rad_s = axis * self.qd_rad_s[joint];
        let (from, turning_rad_s) = (parent.acceleration, parent.spin_rad_s);
        let linear_m_s2 = from.linear_m_s2
            + from.angular_rad_s2.cross(offset_m)
            + turning_rad_s.cross(turning_rad_s.cross(offset_m));
        let angular_rad_s2 = from.angular_rad_s2 + axis * qdd_rad_s2 + turning_rad_s.cross(along_rad_s);
        (turning_rad_s + along_rad_s, Acceleration { linear_m_s2, angular_rad_s2 })
    }

    /// Returns the force and the moment about its origin that the motion of one link requires.
    fn effort_of_link(
        &self,
        link: usize,
        spin_rad_s: Vector,
        acceleration: Acceleration,
    ) -> (Vector, Vector) {
        let mass = &self.model.links[link].mass;
        let rotation = self.world_from_link[link].rotation;
        let centre_m = rotation * mass.local_com;
        let centre_m_s2 = acceleration.linear_m_s2
            + acceleration.angular_rad_s2.cross(centre_m)
            + spin_rad_s.cross(spin_rad_s.cross(centre_m));
        let gravity_m_s2 = Vector::new(0.0, 0.0, -GRAVITY_M_S2);
        let force_n = (centre_m_s2 - gravity_m_s2) * mass.mass();
        let axes = rotation * mass.principal_inertia_local_frame;
        let principal_kg_m2 = mass.inv_principal_inertia.recip();
        let inertia = |v: Vector| axes * (principal_kg_m2 * (axes.inverse() * v));
        let turn_n_m = inertia(acceleration.angular_rad_s2) + spin_rad_s.cross(inertia(spin_rad_s));
        (force_n, turn_n_m + centre_m.cross(force_n))
    }
}
