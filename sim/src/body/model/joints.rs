//! The joints of a robot's file in published order, with rigid ones for those that it lacks.

use rapier3d::math::Vector;

use super::JointModel;
use crate::SimError;
use crate::body::layout::{
    ARM_JOINTS, ARMS, HAND_JOINTS, HANDS, LEG_JOINTS, LEGS, WAIST, WAIST_JOINTS, joint_names,
};
use crate::mjcf::{Actuator, ActuatorKind, AxisJoint, BodyTree, Document, LinkJoint};

/// Returns the joints that the file's actuators move.
pub(super) fn joints_of_file(document: &Document, tree: &BodyTree) -> Result<Vec<JointModel>, SimError> {
    let rest = document.keys()?.into_iter().next();
    let rest = rest.ok_or_else(|| document.unsupported("needs a <keyframe> to stand in"))?.positions;
    let mut joints: Vec<JointModel> = Vec::new();
    for actuator in document.actuators()? {
        let name = &actuator.joint;
        let index = tree.links.iter().position(|link| link.joint.name() == Some(name));
        let refuse = |what: &str| document.unsupported(format!("joint `{name}` {what}"));
        let link = index.ok_or_else(|| refuse("is not the robot's"))?;
        if joints.iter().any(|joint| joint.link == link) {
            return Err(refuse("has two actuators; put both into one"));
        }
        // The coordinate of a joint follows seven coordinates of the root, and one of each joint before it.
        let rest_rad = rest.get(6 + link).copied().unwrap_or(0.0) as f32;
        let joint = match &tree.links[link].joint {
            LinkJoint::Hinge(joint) => joint_model(joint, &actuator, link, rest_rad),
            LinkJoint::Slide(_) | LinkJoint::Free { .. } | LinkJoint::Fixed => Err("is no hinge; use hinges"),
        };
        joints.push(joint.map_err(refuse)?);
    }
    in_published_order(joints).map_err(|what| document.unsupported(what))
}

/// Returns the joints in published order, including rigid ones for those that the robot lacks. The text of an
/// error states the requirement.
pub(super) fn in_published_order(mut found: Vec<JointModel>) -> Result<Vec<JointModel>, String> {
    let names = joint_names();
    if let Some(other) = found.iter().find(|joint| !names.contains(&joint.name)) {
        let have = names.join(", ");
        return Err(format!("joint `{}` is none of a robot's; they are called: {have}", other.name));
    }
    check_legs(&found, &names)?;
    let mut joints: Vec<JointModel> = Vec::with_capacity(names.len());
    for (index, name) in names.into_iter().enumerate() {
        let own = found.iter().position(|joint| joint.name == name);
        let carrier = carrier(&joints, index);
        joints.push(own.map_or_else(|| JointModel::lacking(name, carrier), |own| found.swap_remove(own)));
    }
    Ok(joints)
}

/// Checks that both legs have all joints. They may both lack the ankle's roll.
fn check_legs(found: &[JointModel], names: &[String]) -> Result<(), String> {
    let lacks = |index: usize| found.iter().all(|joint| joint.name != names[index]);
    let rolls = LEGS.map(|first| first + LEG_JOINTS - 1);
    let both_lack_roll = lacks(rolls.left) && lacks(rolls.right);
    let may_lack = |index: usize| both_lack_roll && (index == rolls.left || index == rolls.right);
    let lacking: Vec<String> = (0..WAIST)
        .filter(|index| lacks(*index) && !may_lack(*index))
        .map(|index| format!("`{}`", names[index]))
        .collect();
    if lacking.is_empty() {
        return Ok(());
    }
    let joints = if lacking.len() == 1 { "a joint" } else { "the joints" };
    let have = "only waist, arms and hands may lack joints, and both ankles their roll";
    Err(format!("needs {joints} {}; {have}", lacking.join(", ")))
}

/// Returns the link that carries a joint of the published order; `joints` are the earlier joints.
fn carrier(joints: &[JointModel], index: usize) -> usize {
    // The last joint of a group in the tree, for any order of the group's joints.
    let end = |first: usize, count: usize| {
        joints[first..first + count].iter().map(|joint| joint.link).max().unwrap_or_default()
    };
    for (first, hand) in ARMS.into_iter().zip(HANDS) {
        if index == first {
            return end(WAIST, WAIST_JOINTS);
        }
        if (hand..hand + HAND_JOINTS).contains(&index) {
            return end(first, ARM_JOINTS);
        }
    }
    if index == LEGS.left || index == LEGS.right || index == WAIST { 0 } else { joints[index - 1].link }
}

impl JointModel {
    /// Creates the joint that a robot lacks, on the link where it would be.
    fn lacking(name: String, link: usize) -> JointModel {
        JointModel {
            name,
            link,
            axis: Vector::ZERO,
            lower_rad: 0.0,
            upper_rad: 0.0,
            armature_kg_m2: 0.0,
            friction_n_m: 0.0,
            kp_n_m_rad: 0.0,
            kd_n_m_s_rad: 0.0,
            effort_n_m: f32::INFINITY,
            speed_limit_rad_s: f32::INFINITY,
            rest_rad: 0.0,
        }
    }
}

fn joint_model(
    joint: &AxisJoint,
    actuator: &Actuator,
    link: usize,
    rest_rad: f32,
) -> Result<JointModel, &'static str> {
    let axis = &joint.axis;
    let [lower, upper] = axis.range.ok_or("needs a range")?;
    let effort = match actuator.effort_range {
        Some([low, high]) if low == -high => high,
        Some(_) => return Err("is stronger one way; use a forcerange of -x x"),
        None => return Err("needs a forcerange on its actuator"),
    };
    let ActuatorKind::Position { kp, kd } = actuator.kind else {
        return Err("needs a <position> actuator");
    };
    if kp == 0.0 || kd == 0.0 {
        return Err("needs a kp and a kv above 0 on its actuator");
    }
    if actuator.control_range.is_some() {
        return Err("is told targets within its range; leave out the actuator's ctrlrange");
    }
    if axis.anchor_m != Default::default() {
        return Err("turns beside its body's origin; put the body there");
    }
    if axis.stiffness != 0.0 || axis.damping != 0.0 {
        return Err("has a spring or a damper; state kp and kv on its actuator");
    }
    Ok(JointModel {
        name: joint.name.clone(),
        link,
        axis: axis.direction.as_vec3().normalize(),
        lower_rad: lower as f32,
        upper_rad: upper as f32,
        armature_kg_m2: axis.armature as f32,
        friction_n_m: axis.friction_loss as f32,
        kp_n_m_rad: kp as f32,
        kd_n_m_s_rad: kd as f32,
        effort_n_m: effort as f32,
        speed_limit_rad_s: actuator.speed_limit.map_or(f32::INFINITY, |limit| limit as f32),
        rest_rad,
    })
}
