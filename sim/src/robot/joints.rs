//! The joints of a robot in Rapier's multibody: what they read, and their springs and dampers.

use rapier3d::prelude::{Multibody, MultibodyJointHandle, PhysicsWorld};

use crate::body::{Drive, JOINTS, RobotModel, WholeBody};

/// In published order.
pub(super) struct Joints {
    /// Any joint leads to the multibody.
    pub any: MultibodyJointHandle,
    /// Multibody link index and degree of freedom of each joint.
    pub slots: Vec<(usize, usize)>,
}

impl Joints {
    /// Coordinates (rad) and velocities (rad/s).
    pub(super) fn read(&self, physics: &PhysicsWorld) -> ([f32; JOINTS], [f32; JOINTS]) {
        let mut q_rad = [0.0; JOINTS];
        let mut qd_rad_s = [0.0; JOINTS];
        if let Some((multibody, _)) = physics.multibody_joints.get(self.any) {
            let velocity = multibody.generalized_velocity();
            for (joint, (link, dof)) in self.slots.iter().enumerate() {
                q_rad[joint] = multibody.link(*link).map_or(0.0, |link| link.joint().coords()[3]);
                qd_rad_s[joint] = velocity[*dof];
            }
        }
        (q_rad, qd_rad_s)
    }

    /// PD by the joint's own spring and damper, which the mass matrix contains, so that both are implicit:
    ///   tau = kp (rest - q) - kd qd,   rest = target + feedforward / kp,   with rest clamped so that |tau| <= effort.
    /// Returns tau (N m).
    pub(super) fn apply(
        &self,
        physics: &mut PhysicsWorld,
        body: &WholeBody,
        drives: &[Drive; JOINTS],
    ) -> [f32; JOINTS] {
        let mut torque_n_m = [0.0; JOINTS];
        let Some((multibody, _)) = physics.multibody_joints.get_mut(self.any) else { return torque_n_m };
        for (joint, drive) in drives.iter().enumerate() {
            let effort_n_m = body.model.joints[joint].effort_n_m;
            let (link, dof) = self.slots[joint];
            let q_rad = body.q_rad[joint];
            let damping_n_m = drive.kd_n_m_s_rad * body.qd_rad_s[joint];
            let spring_n_m = drive.kp_n_m_rad * (drive.target_rad - q_rad) + drive.feedforward_n_m;
            torque_n_m[joint] = (spring_n_m - damping_n_m).clamp(-effort_n_m, effort_n_m);
            multibody.damping_mut()[dof] = drive.kd_n_m_s_rad;
            if let Some(link) = multibody.link_mut(link) {
                let rest_rad = q_rad + (torque_n_m[joint] + damping_n_m) / drive.kp_n_m_rad;
                link.joint.set_spring(3, drive.kp_n_m_rad, rest_rad);
            }
        }
        torque_n_m
    }

    /// Gives the joints their armature and friction, and moves them from coordinate 0 to `q_rad`.
    pub(super) fn prepare(&self, multibody: &mut Multibody, model: &RobotModel, q_rad: &[f32]) {
        // Rapier damps every angular coordinate by default, the free root's too.
        multibody.damping_mut().fill(0.0);
        let mut displacement = vec![0.0; multibody.ndofs()];
        for (joint, (_, dof)) in self.slots.iter().enumerate() {
            multibody.armature_mut()[*dof] = model.joints[joint].armature_kg_m2;
            multibody.frictions_mut()[*dof] = model.joints[joint].friction_n_m;
            displacement[*dof] = q_rad[joint];
        }
        multibody.apply_displacements(&displacement);
    }
}
