//! Inverse dynamics of one robot: joint torques and the wrench from outside that a wanted motion takes.
//!
//! Newton-Euler in the world frame. Outwards, with r, a the origin and axis of a joint and p the parent link:
//!   w = w_p + a q',   dw = dw_p + a q'' + w_p x a q',   acc = acc_p + dw_p x r + w_p x (w_p x r).
//! Inwards: f = m (acc_c - g),  n = I dw + w x I w,  summed up to the pelvis;  tau = a . n + armature q''.
//! Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 5.

use rapier3d::math::Vector;

use super::{JOINTS, WholeBody};
use crate::GRAVITY_M_S2;

/// Of a link, at its origin, world frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Acceleration {
    pub linear_m_s2: Vector,
    pub angular_rad_s2: Vector,
}

/// What a motion takes.
pub struct Effort {
    /// On each joint, in published order.
    pub torque_n_m: [f32; JOINTS],
    /// On the whole robot from outside, beside gravity.
    pub force_n: Vector,
    /// About the pelvis' origin.
    pub moment_n_m: Vector,
    /// Of each link, in the order of the model.
    pub links: Vec<Acceleration>,
}

impl WholeBody<'_> {
    /// Effort of the acceleration of the pelvis and of all joints (rad/s^2), at the measured positions and velocities.
    pub fn inverse_dynamics(&self, pelvis: Acceleration, qdd_rad_s2: &[f32; JOINTS]) -> Effort {
        let count = self.model.links.len();
        let mut links = Vec::with_capacity(count);
        let mut spin_rad_s = Vec::with_capacity(count);
        let mut force_n = Vec::with_capacity(count);
        let mut moment_n_m = Vec::with_capacity(count);
        let gravity_m_s2 = Vector::new(0.0, 0.0, -GRAVITY_M_S2);
        for (index, link) in self.model.links.iter().enumerate() {
            let world = self.world_from_link[index];
            let (spin, acceleration) = match (link.parent, link.joint) {
                (Some(parent), Some(joint)) => {
                    let axis = world.rotation * self.model.joints[joint].axis;
                    let along = axis * self.qd_rad_s[joint];
                    let from: Acceleration = links[parent];
                    let turning: Vector = spin_rad_s[parent];
                    let offset_m = world.translation - self.world_from_link[parent].translation;
                    let linear_m_s2 = from.linear_m_s2
                        + from.angular_rad_s2.cross(offset_m)
                        + turning.cross(turning.cross(offset_m));
                    let angular_rad_s2 =
                        from.angular_rad_s2 + axis * qdd_rad_s2[joint] + turning.cross(along);
                    (turning + along, Acceleration { linear_m_s2, angular_rad_s2 })
                }
                _ => (self.pelvis_angular_velocity_rad_s, pelvis),
            };
            let mass_kg = link.mass.mass();
            let centre_m = world.rotation * link.mass.local_com;
            let centre_m_s2 = acceleration.linear_m_s2
                + acceleration.angular_rad_s2.cross(centre_m)
                + spin.cross(spin.cross(centre_m));
            let force = (centre_m_s2 - gravity_m_s2) * mass_kg;
            let axes = world.rotation * link.mass.principal_inertia_local_frame;
            let principal_kg_m2 = link.mass.inv_principal_inertia.recip();
            let inertia = |v: Vector| axes * (principal_kg_m2 * (axes.inverse() * v));
            let turn = inertia(acceleration.angular_rad_s2) + spin.cross(inertia(spin));
            links.push(acceleration);
            spin_rad_s.push(spin);
            force_n.push(force);
            moment_n_m.push(turn + centre_m.cross(force));
        }
        let mut torque_n_m = [0.0; JOINTS];
        for (index, link) in self.model.links.iter().enumerate().rev() {
            let (Some(parent), Some(joint)) = (link.parent, link.joint) else { continue };
            let (force, moment): (Vector, Vector) = (force_n[index], moment_n_m[index]);
            let world = self.world_from_link[index];
            let model = &self.model.joints[joint];
            torque_n_m[joint] =
                (world.rotation * model.axis).dot(moment) + model.armature_kg_m2 * qdd_rad_s2[joint];
            let offset_m = world.translation - self.world_from_link[parent].translation;
            force_n[parent] += force;
            moment_n_m[parent] += moment + offset_m.cross(force);
        }
        Effort { torque_n_m, force_n: force_n[0], moment_n_m: moment_n_m[0], links }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{RobotPlacement, World, WorldSpec};

    /// A robot at rest takes its weight from outside and gravity's torques from its joints; accelerated as a whole, its
    /// mass times that more.
    #[test]
    fn rest_takes_the_weight_and_acceleration_its_inertia() {
        let placement = RobotPlacement { name: "A".into(), position_m: [0.3, 0.1], yaw_rad: 0.7 };
        let spec = WorldSpec { scene: "floor".into(), robots: vec![placement], objects: vec![] };
        let world = World::new(&spec).unwrap();
        let body = world.robots()[0].measure(&world.physics);
        let weight_n = Vector::new(0.0, 0.0, body.model.mass_kg * GRAVITY_M_S2);
        let rest = body.inverse_dynamics(Acceleration::default(), &[0.0; JOINTS]);
        assert!((rest.force_n - weight_n).length() < 1e-2, "{}", rest.force_n);
        let lever_m = body.com_m - body.world_from_pelvis().translation;
        assert!((rest.moment_n_m - lever_m.cross(weight_n)).length() < 1e-2, "{}", rest.moment_n_m);
        for (torque, gravity) in rest.torque_n_m.iter().zip(body.gravity_torques_n_m()) {
            assert!((torque - gravity).abs() < 1e-3, "{torque} {gravity}");
        }
        let push_m_s2 = Vector::new(1.0, -2.0, 0.5);
        let pushed = body.inverse_dynamics(
            Acceleration { linear_m_s2: push_m_s2, ..Acceleration::default() },
            &[0.0; JOINTS],
        );
        let force_n = weight_n + push_m_s2 * body.model.mass_kg;
        assert!((pushed.force_n - force_n).length() < 1e-2, "{}", pushed.force_n);
    }
}
