//! Reading and setting the state of a tree.

use rapier3d::glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

use super::link::Joint;
use super::spatial::ForceVector;
use super::tree::Tree;

/// State of a tree that outlasts a step, in full precision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TreeState {
    base: DPose3,
    q: Vec<f64>,
    v: Vec<f64>,
    effort: Vec<f64>,
    dry_friction: Vec<f64>,
}

impl Tree {
    /// Returns the position of a hinge (rad) or slide (m); 0 for other joints.
    pub fn joint_position(&self, link: usize) -> f64 {
        self.q[link]
    }

    /// Returns the velocity of a hinge (rad/s) or slide (m/s); 0 for other joints.
    pub fn joint_velocity(&self, link: usize) -> f64 {
        self.links[link].joint.axis().map_or(0.0, |_| self.v[self.layout.first_dof[link]])
    }

    /// Returns the speed of a joint as a share of its motor's limit. Returns `None` if the motor has no
    /// limit.
    pub fn motor_speed_share(&self, link: usize) -> Option<f64> {
        let limit = self.links[link].joint.axis()?.speed_limit;
        limit.is_finite().then(|| self.joint_velocity(link).abs() / limit)
    }

    /// Returns the distance of a hinge (rad) or slide (m) beyond its range. Returns 0 within the range, and
    /// for other joints.
    pub fn beyond_range(&self, link: usize) -> f64 {
        let range = self.links[link].joint.axis().and_then(|axis| axis.range);
        range.map_or(0.0, |[low, high]| (low - self.q[link]).max(self.q[link] - high).max(0.0))
    }

    /// Returns the mean effort of a joint's drive over the last step (N m or N). It is within the effort
    /// limit, unless the drive brakes a motion faster than the drive's speed limit.
    pub fn drive_effort(&self, link: usize) -> f64 {
        self.effort[link]
    }

    /// Sets the position and velocity of a hinge or slide. Other joints are unchanged.
    pub fn set_joint(&mut self, link: usize, position: f64, velocity: f64) {
        if self.links[link].joint.axis().is_some() {
            self.q[link] = position;
            self.v[self.layout.first_dof[link]] = velocity;
            self.kinematics();
        }
    }

    /// Sets the pose of a free tree, and the velocity of the origin of its first link. A fixed tree is
    /// unchanged.
    pub fn set_base(&mut self, world_from_base: DPose3, velocity_m_s: DVec3, spin_rad_s: DVec3) {
        if matches!(self.links[0].joint, Joint::Free) {
            self.base = world_from_base;
            let arm_m = world_from_base.rotation * self.links[0].mass.com_m;
            (velocity_m_s + spin_rad_s.cross(arm_m)).write_to_slice(&mut self.v[..3]);
            spin_rad_s.write_to_slice(&mut self.v[3..6]);
            self.kinematics();
        }
    }

    /// Applies a force (N, world axes) at a point (world frame) of a link in the next step. Forces add up.
    pub fn push(&mut self, link: usize, point_m: DVec3, force_n: DVec3) {
        self.external[link] += ForceVector::at(point_m - self.reference_m, force_n);
    }

    /// Applies a torque (N m, world axes) to a link in the next step.
    pub fn twist(&mut self, link: usize, torque_n_m: DVec3) {
        self.external[link] += ForceVector::moment(torque_n_m);
    }

    /// Returns the centre of mass of the whole tree, world frame.
    pub fn com_m(&self) -> DVec3 {
        let moment = |(i, link): (usize, &crate::dynamics::Link)| self.centre_m(i) * link.mass.mass_kg;
        let sum: DVec3 = self.links.iter().enumerate().map(moment).sum();
        self.reference_m + sum / self.mass_kg()
    }

    pub fn state(&self) -> TreeState {
        TreeState {
            base: self.base,
            q: self.q.clone(),
            v: self.v.clone(),
            effort: self.effort.clone(),
            dry_friction: self.dry_friction.clone(),
        }
    }

    /// Returns true if the state belongs to a tree of the same structure.
    pub(in crate::dynamics) fn fits(&self, state: &TreeState) -> bool {
        state.q.len() == self.q.len() && state.v.len() == self.v.len()
    }

    /// Restores a state for which [`Tree::fits`] is true.
    pub(in crate::dynamics) fn restore(&mut self, state: &TreeState) {
        self.base = state.base;
        self.q.clone_from(&state.q);
        self.v.clone_from(&state.v);
        self.effort.clone_from(&state.effort);
        self.dry_friction.clone_from(&state.dry_friction);
        self.kinematics();
    }
}
