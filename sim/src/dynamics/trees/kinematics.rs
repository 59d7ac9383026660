//! Poses, joint axes and velocities of a tree's links.

use pulp::{Arch, Simd, WithSimd};
use rapier3d::glamx::{DMat3, DPose3, DQuat, DVec3};

use super::link::Joint;
use super::spatial::{MotionVector, turned};
use super::tree::Tree;

/// Kinematics on the widest vector registers of the processor, with bit-identical results.
struct Kinematics<'a> {
    tree: &'a mut Tree,
}

impl WithSimd for Kinematics<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        self.tree.pose_links();
    }
}

impl Tree {
    /// Computes poses and axes from joint positions, with p the parent:  R = R_p R_0 R(q),
    /// r = r_p + R_p (t_0 + ...),  and the axes
    ///   S = (a, r_a x a) of a hinge through r_a,  S = (0, a) of a slide,  both with a = R_p R_0 direction.
    /// Source: Featherstone 2008, section 4.1 and table 4.1, in world axes.
    pub(in crate::dynamics) fn kinematics(&mut self) {
        Arch::new().dispatch(Kinematics { tree: self });
    }

    #[inline(always)]
    fn pose_links(&mut self) {
        let root = &self.links[0];
        self.reference_m = match root.joint {
            Joint::Free => self.base * root.mass.com_m,
            Joint::Fixed | Joint::Hinge(_) | Joint::Slide(_) => root.parent_from_link.translation,
        };
        for (i, link) in self.links.iter().enumerate() {
            let (parent_rotation, parent_m) = match link.parent {
                Some(parent) => (self.rotation[parent], self.position_m[parent]),
                None => (DMat3::IDENTITY, -self.reference_m),
            };
            let (turned, moved_m) = match link.joint {
                Joint::Free => (DMat3::from_quat(self.base.rotation), self.base.translation),
                Joint::Fixed | Joint::Hinge(_) | Joint::Slide(_) => {
                    (self.parent_from_link_rotation[i], link.parent_from_link.translation)
                }
            };
            let rotation = parent_rotation * turned;
            let origin_m = parent_m + parent_rotation * moved_m;
            let dof = self.layout.first_dof[i];
            (self.rotation[i], self.position_m[i]) = match &link.joint {
                Joint::Fixed => (rotation, origin_m),
                Joint::Free => {
                    for (c, unit) in DVec3::AXES.into_iter().enumerate() {
                        self.axis[dof + c] = MotionVector { angular: DVec3::ZERO, linear: unit };
                        self.axis[dof + 3 + c] = MotionVector { angular: unit, linear: DVec3::ZERO };
                    }
                    (rotation, origin_m)
                }
                Joint::Hinge(axis) => {
                    let angular = rotation * axis.direction;
                    let through_m = origin_m + rotation * axis.anchor_m;
                    self.axis[dof] = MotionVector { angular, linear: through_m.cross(angular) };
                    let rotation = rotation * DMat3::from_axis_angle(axis.direction, self.q[i]);
                    (rotation, through_m - rotation * axis.anchor_m)
                }
                Joint::Slide(axis) => {
                    let linear = rotation * axis.direction;
                    self.axis[dof] = MotionVector { angular: DVec3::ZERO, linear };
                    (rotation, origin_m + linear * self.q[i])
                }
            };
        }
        self.velocities();
    }

    /// Computes v = v_p + S q'.
    #[inline(always)]
    pub(in crate::dynamics) fn velocities(&mut self) {
        for (i, link) in self.links.iter().enumerate() {
            let dof = self.layout.first_dof[i];
            let mut velocity = link.parent.map_or(MotionVector::default(), |parent| self.velocity[parent]);
            for k in dof..dof + link.joint.dofs() {
                velocity += self.axis[k] * self.v[k];
            }
            self.velocity[i] = velocity;
        }
    }

    /// Advances the positions by one step at the velocities `v`, and stores `after` as velocities.
    /// [`Tree::kinematics`] must follow. A lone body turns by its mean angular velocity over the step, see
    /// [`Tree::spin_on`].
    pub(in crate::dynamics) fn integrate(&mut self, dt_s: f64, v: &[f64], after: &[f64]) {
        self.v.copy_from_slice(after);
        if let Joint::Free = self.links[0].joint {
            let com_m = self.links[0].mass.com_m;
            let centre_m = self.base * com_m + DVec3::from_slice(&v[..3]) * dt_s;
            let [moving, after] = [v, after].map(|v| DVec3::from_slice(&v[3..6]));
            let (turn_rad, spin_rad_s) = self.spin_on(dt_s, moving, after);
            let rotation = turned(self.base.rotation, turn_rad);
            self.base = DPose3::from_parts(centre_m - rotation * com_m, rotation);
            spin_rad_s.write_to_slice(&mut self.v[3..6]);
        }
        for (i, link) in self.links.iter().enumerate() {
            if link.joint.axis().is_some() {
                self.q[i] += dt_s * v[self.layout.first_dof[i]];
            }
        }
    }

    pub fn world_from_link(&self, link: usize) -> DPose3 {
        let rotation = DQuat::from_mat3(&self.rotation[link]);
        DPose3::from_parts(self.reference_m + self.position_m[link], rotation)
    }

    /// Returns the velocity of the link's origin, world frame.
    pub fn link_velocity_m_s(&self, link: usize) -> DVec3 {
        self.velocity[link].at(self.position_m[link])
    }

    /// Returns the velocity of the link's centre of mass, world frame.
    pub fn com_velocity_m_s(&self, link: usize) -> DVec3 {
        self.velocity[link].at(self.centre_m(link))
    }

    /// Returns the velocity of a point that is fixed to a link and currently at `point_m` in the world.
    pub fn point_velocity_m_s(&self, link: usize, point_m: DVec3) -> DVec3 {
        self.velocity[link].at(point_m - self.reference_m)
    }

    pub fn link_spin_rad_s(&self, link: usize) -> DVec3 {
        self.velocity[link].angular
    }

    /// Returns the centre of mass of a link relative to the tree's reference.
    pub(in crate::dynamics) fn centre_m(&self, link: usize) -> DVec3 {
        self.position_m[link] + self.rotation[link] * self.links[link].mass.com_m
    }
}
