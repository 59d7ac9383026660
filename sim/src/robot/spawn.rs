//! Puts a robot model into a physics world as one multibody.

use std::sync::Arc;

use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::prelude::*;

use super::{JOINTS, Memory, Robot, RobotModel, UPPER, hand_force::HandForce, layout, payload::Payload};
use crate::SimError;
use crate::locomotion::{Balance, BaseCommand};
use crate::world::{RobotPlacement, link_tag};

impl Robot {
    /// Inserts a robot standing on the floor (z = 0) in its rest pose. `index` tells robots of one world apart.
    pub(crate) fn spawn(
        physics: &mut PhysicsWorld,
        model: &Arc<RobotModel>,
        placement: &RobotPlacement,
        index: usize,
    ) -> Result<Robot, SimError> {
        layout::check(&placement.name, model)?;
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
        let (joints, slots) = connect(physics, model, &bodies, &q_rad);
        let last_upper_rad = UPPER.iter().map(|joint| q_rad[*joint]).collect();
        let pelvis_height_m = world_from_link[0].translation.z;
        let memory = Memory {
            last_upper_rad,
            torque_n_m: vec![0.0; JOINTS],
            payload: Payload::default(),
            hand_force: HandForce::default(),
            base: BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m },
            fallen: false,
        };
        let name = placement.name.clone();
        let locomotion = Box::new(Balance::default());
        Ok(Robot { name, model: model.clone(), bodies, joints, slots, colliders, locomotion, memory })
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
) -> (Vec<MultibodyJointHandle>, Vec<(usize, usize)>) {
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
    let joints: Vec<MultibodyJointHandle> = handles.into_iter().flatten().collect();
    let mut slots = Vec::with_capacity(joints.len());
    for handle in &joints {
        if let Some((multibody, link)) = physics.multibody_joints.get(*handle) {
            slots.push((link, multibody.link(link).map_or(0, |link| link.assembly_id())));
        }
    }
    if let Some((multibody, _)) = physics.multibody_joints.get_mut(joints[0]) {
        // Rapier damps every angular coordinate by default, the free root's too.
        multibody.damping_mut().fill(0.0);
        let mut displacement = vec![0.0; multibody.ndofs()];
        for (joint, (_, dof)) in slots.iter().enumerate() {
            multibody.armature_mut()[*dof] = model.joints[joint].armature_kg_m2;
            multibody.frictions_mut()[*dof] = model.joints[joint].friction_n_m;
            displacement[*dof] = q_rad[joint];
        }
        multibody.apply_displacements(&displacement);
    }
    (joints, slots)
}
