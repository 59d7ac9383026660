//! Puts a robot model into a physics world as one multibody.

use std::sync::Arc;

use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::prelude::*;

use super::feeling::Feeling;
use super::joints::Joints;
use super::{Memory, Robot};
use crate::SimError;
use crate::body::{JOINTS, RobotModel, UPPER, check_joint_order};
use crate::locomotion::{Balance, BaseCommand};

/// A robot stands on the floor here, facing `yaw_rad` (0 looks along +x).
#[derive(Clone, Debug)]
pub struct RobotPlacement {
    pub name: String,
    pub position_m: [f32; 2],
    pub yaw_rad: f32,
}

/// Collider tag of a robot's link: robot and link, both counted from 1, so that 0 is anything else.
fn link_tag(robot: usize, link: usize) -> u128 {
    ((robot as u128 + 1) << 32) | (link as u128 + 1)
}

/// Robot and link of a collider's tag.
pub(crate) fn robot_and_link(tag: u128) -> Option<(usize, usize)> {
    let (robot, link) = ((tag >> 32) as usize, (tag & 0xffff_ffff) as usize);
    (robot > 0 && link > 0).then(|| (robot - 1, link - 1))
}

impl Robot {
    /// Inserts a robot standing on the floor (z = 0) in its rest pose. `index` tells robots of one world apart.
    pub(crate) fn spawn(
        physics: &mut PhysicsWorld,
        model: &Arc<RobotModel>,
        placement: &RobotPlacement,
        index: usize,
    ) -> Result<Robot, SimError> {
        check_joint_order(&placement.name, model)?;
        let q_rad = model.rest_rad();
        let world_from_link = model.forward_kinematics(standing_pelvis(model, placement, &q_rad), &q_rad);
        let mut bodies = Vec::with_capacity(model.links.len());
        let mut colliders = Vec::new();
        for (link_index, (link, pose)) in model.links.iter().zip(&world_from_link).enumerate() {
            let body = physics.insert_body(
                RigidBodyBuilder::dynamic()
                    .pose(*pose)
                    .additional_mass_properties(link.mass)
                    .can_sleep(false),
            );
            for geom in link.geoms.iter().filter(|geom| geom.collides) {
                let Some((body_from_shape, shape)) = geom.collider() else { continue };
                let collider = ColliderBuilder::new(shape)
                    .position(body_from_shape)
                    .density(0.0)
                    .friction(geom.surface.coefficients.slide)
                    .friction_combine_rule(CoefficientCombineRule::Max)
                    .active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS)
                    .user_data(link_tag(index, link_index));
                colliders.push((physics.insert_collider(collider, Some(body)), link_index));
            }
            bodies.push(body);
        }
        let joints = connect(physics, model, &bodies, &q_rad);
        let memory = Memory {
            last_upper_rad: UPPER.iter().map(|joint| q_rad[*joint]).collect(),
            torque_n_m: vec![0.0; JOINTS],
            feeling: Feeling::default(),
            base: BaseCommand::standing(world_from_link[0].translation.z),
            fallen: false,
        };
        let name = placement.name.clone();
        let locomotion = Box::new(Balance::default());
        Ok(Robot { name, model: model.clone(), bodies, joints, colliders, locomotion, memory })
    }
}

/// Pelvis pose at which the lowest collision shape of the feet touches the floor.
fn standing_pelvis(model: &RobotModel, placement: &RobotPlacement, q_rad: &[f32]) -> Pose {
    let [x, y] = placement.position_m;
    let heading = Rotation::from_rotation_z(placement.yaw_rad);
    let at = |z| Pose::from_parts(Vector::new(x, y, z), heading);
    let lowest_m = model
        .links
        .iter()
        .zip(model.forward_kinematics(at(0.0), q_rad))
        .flat_map(|(link, world_from_link)| {
            let colliding = link.geoms.iter().filter(|geom| geom.collides).filter_map(|geom| geom.collider());
            colliding.map(move |(pose, shape)| shape.compute_aabb(&(world_from_link * pose)).mins.z)
        })
        .fold(f32::INFINITY, f32::min);
    at(-lowest_m)
}

/// Joins the links; joints start at coordinate 0 whatever the body poses, so they are moved to `q_rad` afterwards.
fn connect(
    physics: &mut PhysicsWorld,
    model: &RobotModel,
    bodies: &[RigidBodyHandle],
    q_rad: &[f32],
) -> Joints {
    let mut handles = vec![None; model.joints.len()];
    for (index, link) in model.links.iter().enumerate() {
        let (Some(parent), Some(joint)) = (link.parent, link.joint) else { continue };
        let joint_model = &model.joints[joint];
        // Rapier's hinges turn about x.
        let axis_from_x = Pose::from_rotation(Rotation::from_rotation_arc(Vector::X, joint_model.axis));
        let hinge = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
            .local_frame1(link.parent_from_link * axis_from_x)
            .local_frame2(axis_from_x)
            .limits(JointAxis::AngX, [joint_model.lower_rad, joint_model.upper_rad])
            .contacts_enabled(false);
        handles[joint] = physics.insert_multibody_joint(bodies[parent], bodies[index], hinge.build());
    }
    let handles: Vec<MultibodyJointHandle> = handles.into_iter().flatten().collect();
    let mut joints = Joints { any: handles[0], slots: Vec::with_capacity(handles.len()) };
    for handle in &handles {
        if let Some((multibody, link)) = physics.multibody_joints.get(*handle) {
            joints.slots.push((link, multibody.link(link).map_or(0, |link| link.assembly_id())));
        }
    }
    if let Some((multibody, _)) = physics.multibody_joints.get_mut(joints.any) {
        joints.prepare(multibody, model, q_rad);
    }
    joints
}
