//! Joint limits of third-party MJCF: ranges, efforts and rest angles, from any place in the file that has
//! them.

use std::collections::BTreeMap;

use mjcf_rs::body::JointType;

use super::description::RobotDescription;
use super::{JointModel, RobotModel};
use crate::SimError;
use crate::mjcf::{Actuator, ActuatorKind, AxisJoint, BodyLink, Document};

/// Data of a joint that the file gives outside the joint element.
#[derive(Clone, Debug, Default)]
pub(super) struct FileLimits {
    effort_range_n_m: Option<[f64; 2]>,
    /// Range of a position actuator's commands.
    pub control_range_rad: Option<[f64; 2]>,
    rest_rad: Option<f64>,
}

/// Returns the limits by the joint names of the file.
pub(super) fn limits_of_file(document: &Document) -> Result<BTreeMap<String, FileLimits>, SimError> {
    let mut found: BTreeMap<String, FileLimits> = BTreeMap::new();
    for (joint, rest_rad) in rest_rad(document)? {
        found.entry(joint).or_default().rest_rad = Some(rest_rad);
    }
    let actuators = document.actuators()?;
    let joints = document.model.bodies.iter().flat_map(|entry| &entry.body.joints);
    for name in joints.filter_map(|joint| joint.name.as_ref()) {
        let limits = found.entry(name.clone()).or_default();
        for actuator in actuators.iter().filter(|actuator| actuator.joint == *name) {
            limits.effort_range_n_m = effort_range_n_m(actuator).or(limits.effort_range_n_m);
            if matches!(actuator.kind, ActuatorKind::Position { .. }) {
                limits.control_range_rad = actuator.control_range.or(limits.control_range_rad);
            }
        }
        limits.effort_range_n_m = document.effort_range(name, limits.effort_range_n_m);
    }
    Ok(found)
}

/// Returns the effort range of an actuator. For a motor without one, it is the control range.
fn effort_range_n_m(actuator: &Actuator) -> Option<[f64; 2]> {
    let commanded = || {
        let [low, high] = actuator.control_range?.map(|command| command * actuator.gear);
        (actuator.kind == ActuatorKind::Motor).then_some([low.min(high), low.max(high)])
    };
    actuator.effort_range.or_else(commanded)
}

/// Returns the angles of the file's first key, by the file's joint names; empty without a key.
fn rest_rad(document: &Document) -> Result<BTreeMap<String, f64>, SimError> {
    let Some(key) = document.keys()?.into_iter().next() else { return Ok(BTreeMap::new()) };
    let joints = document.model.bodies.iter().flat_map(|entry| &entry.body.joints);
    let mut positions = key.positions.into_iter();
    let mut angles_rad = BTreeMap::new();
    for joint in joints {
        if joint.type_ == JointType::Free {
            positions.by_ref().take(7).for_each(drop);
        } else if let Some(angle_rad) = positions.next() {
            angles_rad.insert(joint.name.clone().unwrap_or_default(), angle_rad);
        }
    }
    Ok(angles_rad)
}

/// Sources of a joint's data besides its file.
pub(super) struct JointSources<'a> {
    /// Name of the description in messages.
    pub file: &'a str,
    pub description: &'a RobotDescription,
    /// Robot that supplies missing limits.
    pub like: Option<&'a RobotModel>,
    pub g1: &'a RobotModel,
}

impl JointSources<'_> {
    /// Returns a joint with the data of the file and the description, and the reasons for refusing it. The
    /// effort is 0 if neither source has a limit. Parts that depend on the robot's size are set later.
    pub(super) fn joint(
        &self,
        joint: &AxisJoint,
        link: usize,
        of: &BodyLink,
        limits: &FileLimits,
    ) -> (JointModel, Vec<String>) {
        let (name, axis) = (&joint.name, &joint.axis);
        let alike = |robot: &RobotModel| robot.joints.iter().find(|other| other.name == *name).cloned();
        let like = self.like.and_then(alike);
        let described = self.description;
        let mut wrong = Vec::new();
        if axis.range.is_none() {
            wrong.push(format!("needs a range, or one for `{name}` in [range_rad] of {}", self.file));
        }
        if axis.stiffness != 0.0 {
            wrong.push("has a spring; leave out its stiffness".into());
        }
        if of.is_part || joint.placed_at != 0.0 {
            wrong.push("a robot's bodies have one joint each, without `ref`".into());
        }
        if of.mass.mass() <= 0.0 {
            wrong.push(format!("its body `{}` has no mass; give it an <inertial>", of.name));
        }
        let of_file = match limits.effort_range_n_m {
            Some([low, high]) if low == -high => Some(high as f32),
            Some(_) if !described.effort_n_m.contains_key(name) => {
                let what = format!("is stronger one way; use a range of -x x, or `{name}` in [effort_n_m]");
                wrong.push(what);
                None
            }
            Some(_) | None => None,
        };
        let given = described.effort_n_m.get(name).copied();
        let effort = given.or(of_file).or(like.as_ref().map(|like| like.effort_n_m));
        // Joints without a limit are reported together.
        let without = if wrong.is_empty() { 0.0 } else { 1.0 };
        (self.joint_model(joint, link, limits, effort.unwrap_or(without), like.as_ref()), wrong)
    }

    fn joint_model(
        &self,
        joint: &AxisJoint,
        link: usize,
        limits: &FileLimits,
        effort_n_m: f32,
        like: Option<&JointModel>,
    ) -> JointModel {
        let (name, axis) = (&joint.name, &joint.axis);
        let [lower_rad, upper_rad] = axis.range.unwrap_or([-1.0, 1.0]).map(|end| end as f32);
        let speed = self.description.speed_limit_rad_s.get(name).copied();
        let own_rest_rad = self.description.rest_rad.get(name).copied();
        let own_rest_rad = own_rest_rad.or(limits.rest_rad.map(|rest| rest as f32));
        let g1 = self.g1.joints.iter().find(|other| other.name == *name);
        let rest_rad = own_rest_rad.or(g1.map(|g1| g1.rest_rad)).unwrap_or(0.0);
        let or_like = |own: f64, of: fn(&JointModel) -> f32| match like {
            Some(like) if own == 0.0 => of(like),
            Some(_) | None => own as f32,
        };
        JointModel {
            name: name.clone(),
            link,
            axis: axis.direction.as_vec3().normalize(),
            lower_rad,
            upper_rad,
            armature_kg_m2: or_like(axis.armature, |like| like.armature_kg_m2),
            friction_n_m: or_like(axis.friction_loss, |like| like.friction_n_m),
            kp_n_m_rad: 0.0,
            kd_n_m_s_rad: 0.0,
            effort_n_m,
            speed_limit_rad_s: speed.or(like.map(|like| like.speed_limit_rad_s)).unwrap_or(f32::INFINITY),
            rest_rad: rest_rad.clamp(lower_rad, upper_rad),
        }
    }
}
