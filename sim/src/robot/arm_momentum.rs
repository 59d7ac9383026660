//! Observer of external torques on an arm, by the change of the arm's momentum (De Luca et al. 2006,
//! "Collision detection and safe reaction with the DLR-III lightweight manipulator arm").
//!
//! Let joint i have its axis a (unit, world) through o. Let P and L be the linear momentum of everything
//! beyond it and its moment about o, and p = a . L + armature qd. Then
//!   p' = tau - tau_gravity + c + tau_ext,   c = (w x a) . L - a . (o' x P),
//! with w the angular velocity of the link and o' the velocity of o, for any motion of pelvis and waist. The
//! observer follows the known part,
//!   p^' = tau - tau_gravity + c + r,   r = (p - p^) / time,
//! so that r is tau_ext, low-passed. It needs no acceleration, which joint encoders could not provide.
//! At rest r is tau_gravity - tau.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

use crate::body::{ARM_JOINTS, BodyEstimate, LinkModel, LinkMotion};

#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct ArmMomentum {
    /// p^ of each joint; `None` before the first reading.
    followed_n_m_s: Option<[f32; ARM_JOINTS]>,
    outside_n_m: [f32; ARM_JOINTS],
}

/// Time constant of the observer.
pub(super) const OBSERVER_TIME_S: f32 = 0.05;

/// Momentum along a joint's axis, and the part of its change that is due to motion alone.
struct JointMomentum {
    along_n_m_s: f32,
    turning_n_m: f32,
}

impl ArmMomentum {
    /// Runs one physics step. `excess_n_m` are the torques of the drives beyond those that hold the arm
    /// against gravity; `first` is the arm's first joint. Returns the external torques.
    pub(super) fn update(
        &mut self,
        body: &BodyEstimate,
        motions: &[LinkMotion],
        first: usize,
        excess_n_m: &[f32; ARM_JOINTS],
        dt_s: f32,
    ) -> [f32; ARM_JOINTS] {
        let momenta = arm_momenta(body, motions, first);
        let mut followed_n_m_s = self.followed_n_m_s.unwrap_or_else(|| {
            // Starts as if the present torques had acted for a long time.
            std::array::from_fn(|i| momenta[i].along_n_m_s + excess_n_m[i] * OBSERVER_TIME_S)
        });
        for (i, followed) in followed_n_m_s.iter_mut().enumerate() {
            *followed += (excess_n_m[i] + momenta[i].turning_n_m + self.outside_n_m[i]) * dt_s;
            self.outside_n_m[i] = (momenta[i].along_n_m_s - *followed) / OBSERVER_TIME_S;
        }
        self.followed_n_m_s = Some(followed_n_m_s);
        self.outside_n_m
    }
}

/// Computes the momenta of the arm's joints, of which `first` is the first, from the shoulder on.
fn arm_momenta(body: &BodyEstimate, motions: &[LinkMotion], first: usize) -> [JointMomentum; ARM_JOINTS] {
    let model = &body.model;
    // The first of the arm's links, for any order of its joints.
    let joints = &model.joints[first..first + ARM_JOINTS];
    let shoulder = joints.iter().map(|joint| joint.link).min().unwrap_or_default();
    let is_beyond = |link: &LinkModel| link.parent.is_some_and(|parent| parent >= shoulder);
    let end = shoulder + 1 + model.links[shoulder + 1..].iter().take_while(|link| is_beyond(link)).count();
    // Linear momentum of a link and everything beyond it, and its moment about the shoulder's origin.
    let about_m = body.world_from_link[shoulder].translation;
    let mut momenta = vec![(Vector::ZERO, Vector::ZERO); end - shoulder];
    for index in (shoulder..end).rev() {
        let (link, world) = (&model.links[index], &body.world_from_link[index]);
        let LinkMotion { velocity_m_s, spin_rad_s } = motions[index];
        let lever_m = world.rotation * link.mass.local_com;
        let own_n_s = (velocity_m_s + spin_rad_s.cross(lever_m)) * link.mass.mass();
        let axes = world.rotation * link.mass.principal_inertia_local_frame;
        let turning_n_m_s = axes * (link.mass.principal_inertia() * (axes.inverse() * spin_rad_s));
        let (linear, angular) = &mut momenta[index - shoulder];
        *linear += own_n_s;
        *angular += turning_n_m_s + (world.translation + lever_m - about_m).cross(own_n_s);
        let whole = (*linear, *angular);
        if let Some(parent) = link.parent.and_then(|parent| parent.checked_sub(shoulder)) {
            let (linear, angular) = &mut momenta[parent];
            *linear += whole.0;
            *angular += whole.1;
        }
    }
    std::array::from_fn(|i| {
        let joint = &model.joints[first + i];
        let (origin_m, axis) = body.joint_axis(first + i);
        let LinkMotion { velocity_m_s, spin_rad_s } = motions[joint.link];
        let (linear, angular) = momenta[joint.link - shoulder];
        let angular = angular - (origin_m - about_m).cross(linear);
        JointMomentum {
            along_n_m_s: axis.dot(angular) + joint.armature_kg_m2 * body.qd_rad_s[first + i],
            turning_n_m: spin_rad_s.cross(axis).dot(angular) - axis.dot(velocity_m_s.cross(linear)),
        }
    })
}
