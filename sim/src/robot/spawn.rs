//! Insertion of a robot model into a world as one tree.

use std::sync::Arc;

use rapier3d::math::{Pose, Rotation, Vector};

use super::hand_loads::HandLoads;
use super::knowledge::{SelfKnowledge, Sensing};
use super::{Robot, RobotMemory};
use crate::SimError;
use crate::body::{self, RobotModel, UPPER};
use crate::dynamics::{Axis, DVec3, Dynamics, Joint, Link, Mass, Tree};
use crate::locomotion::{Balance, BaseCommand};
use crate::mechanism::{add_collider, precise};
use crate::owner::Owner;

/// Place of a robot on the floor, facing `yaw_rad` (0 looks along +x).
#[derive(Clone, Debug)]
pub struct RobotPlacement {
    pub name: String,
    pub position_m: [f32; 2],
    pub yaw_rad: f32,
}

impl Robot {
    /// Inserts a robot standing on the floor (z = 0) in its rest pose. `index` is its index among the
    /// robots of the world.
    pub(crate) fn spawn(
        dynamics: &mut Dynamics,
        model: &Arc<RobotModel>,
        placement: &RobotPlacement,
        index: usize,
    ) -> Result<Robot, SimError> {
        let q_rad = model.rest_rad();
        let pelvis = standing_pelvis(model, placement, &q_rad);
        let links = model.links.iter().map(|link| tree_link(model, link)).collect();
        let mut tree = Tree::new(&placement.name, links)?;
        tree.set_base(precise(&pelvis), DVec3::ZERO, DVec3::ZERO);
        for (joint, q_rad) in model.joints.iter().zip(&q_rad).filter(|(joint, _)| joint.exists()) {
            tree.set_joint(joint.link, f64::from(*q_rad), 0.0);
        }
        let tree = dynamics.add_tree(tree);
        for (link, geoms) in model.links.iter().map(|link| &link.geoms).enumerate() {
            let owner = Owner::Link { robot: index, link };
            for geom in geoms {
                add_collider(dynamics, geom, Some(tree.link(link)), Some(owner));
            }
        }
        for (a, b) in model.apart() {
            dynamics.keep_apart(tree.link(a), tree.link(b));
        }
        let knowledge =
            SelfKnowledge::new(model, dynamics.tree(tree), &pelvis, Sensing::default(), index as u64);
        let body = knowledge.body(model, dynamics.tree(tree));
        let memory = RobotMemory {
            last_upper_rad: UPPER.iter().map(|joint| q_rad[*joint]).collect(),
            hand_loads: HandLoads::default(),
            knowledge,
            base: BaseCommand::standing(pelvis.translation.z),
            fallen: false,
        };
        let name = placement.name.clone();
        let locomotion = Box::new(Balance::default());
        let (setpoints, readings) = (Vec::new(), Vec::new());
        Ok(Robot { name, model: model.clone(), tree, locomotion, memory, body, setpoints, readings })
    }
}

/// Returns the pelvis pose at which the lowest collision shape of the feet touches the floor.
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

/// Returns a link of the model with the joint that carries it. The first link is free.
fn tree_link(model: &RobotModel, link: &body::LinkModel) -> Link {
    let joint = link.joint.map_or(Joint::Free, |joint| {
        let joint = &model.joints[joint];
        Joint::Hinge(Axis {
            armature: f64::from(joint.armature_kg_m2),
            friction_loss: f64::from(joint.friction_n_m),
            range: Some([f64::from(joint.lower_rad), f64::from(joint.upper_rad)]),
            effort_limit: f64::from(joint.effort_n_m),
            speed_limit: f64::from(joint.speed_limit_rad_s),
            ..Axis::along(joint.axis.as_dvec3())
        })
    });
    Link {
        name: link.name.clone(),
        parent: link.parent,
        parent_from_link: precise(&link.parent_from_link),
        joint,
        mass: Mass::from_rapier(&link.mass),
    }
}
