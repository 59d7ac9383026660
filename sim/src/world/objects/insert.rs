//! Puts scenes and objects into a world.

use rapier3d::math::Pose;
use rapier3d::prelude::PhysicsWorld;

use super::{Object, ObjectModel, ObjectPlacement};
use crate::SimError;
use crate::dynamics::{DPose3, Dynamics, Tree, TreeId};
use crate::mechanism::{Placed, add_collider, add_equalities, links, precise, rounded};
use crate::mjcf::{BodyLink, BodyTree, Document, Geom};
use crate::owner::Owner;

/// Inserts a scene: bodies that no joint moves are its room, the links of the others become objects.
pub(in crate::world) fn insert_scene(
    dynamics: &mut Dynamics,
    physics: &mut PhysicsWorld,
    scene: &Document,
) -> Result<(Vec<Geom>, Vec<Object>), SimError> {
    let mut fixed = Vec::new();
    let mut objects = Vec::new();
    let trees = scene.trees()?;
    let mut placed = Vec::with_capacity(trees.len());
    for tree in &trees {
        let id = if tree.is_fixed() {
            for geom in tree.links.iter().flat_map(in_file) {
                add_collider(dynamics, physics, &geom, None, None);
                fixed.push(geom);
            }
            None
        } else {
            let name = |link: &BodyLink| link.name.clone();
            Some(insert_moving(dynamics, physics, tree, &DPose3::IDENTITY, name, &mut objects)?)
        };
        placed.push(Placed { tree, id });
    }
    add_equalities(dynamics, scene, &placed, &DPose3::IDENTITY)?;
    Ok((fixed, objects))
}

/// Inserts an object file: one top-level body, a mark if no joint moves it. The body has the placement's name, and the
/// links on it have their own after it.
pub(in crate::world) fn insert_object(
    dynamics: &mut Dynamics,
    physics: &mut PhysicsWorld,
    placement: &ObjectPlacement,
    objects: &mut Vec<Object>,
) -> Result<(), SimError> {
    let (document, tree) = ObjectModel::read(&placement.file)?;
    let world_from_file = precise(&placement.world_from_object);
    if tree.is_fixed() {
        let owner = Owner::Object(objects.len());
        for mut geom in tree.links.iter().flat_map(in_file) {
            geom.body_from_geom = placement.world_from_object * geom.body_from_geom;
            add_collider(dynamics, physics, &geom, None, Some(owner));
        }
        objects.push(Object {
            name: placement.name.clone(),
            model: ObjectModel::of(&tree.links[0]),
            link: None,
            world_from_mark: placement.world_from_object * rounded(&tree.links[0].parent_from_link),
        });
        return Ok(());
    }
    let name = |link: &BodyLink| match link.parent {
        None => placement.name.clone(),
        Some(_) => format!("{} {}", placement.name, link.name),
    };
    let id = insert_moving(dynamics, physics, &tree, &world_from_file, name, objects)?;
    add_equalities(dynamics, &document, &[Placed { tree: &tree, id: Some(id) }], &world_from_file)
}

fn insert_moving(
    dynamics: &mut Dynamics,
    physics: &mut PhysicsWorld,
    tree: &BodyTree,
    world_from_file: &DPose3,
    name: impl Fn(&BodyLink) -> String,
    objects: &mut Vec<Object>,
) -> Result<TreeId, SimError> {
    let id = dynamics.add_tree(Tree::new(&name(&tree.links[0]), links(tree, world_from_file))?, physics);
    for (index, link) in tree.links.iter().enumerate() {
        let owner = Owner::Object(objects.len());
        for geom in &link.geoms {
            add_collider(dynamics, physics, geom, Some(id.link(index)), Some(owner));
        }
        objects.push(Object {
            name: name(link),
            model: ObjectModel::of(link),
            link: Some(id.link(index)),
            world_from_mark: Pose::IDENTITY,
        });
    }
    Ok(id)
}

/// Geoms of a link that does not move, in the frame of its file.
fn in_file(link: &BodyLink) -> impl Iterator<Item = Geom> {
    let file_from_link = rounded(&link.parent_from_link);
    link.geoms
        .iter()
        .map(move |geom| Geom { body_from_geom: file_from_link * geom.body_from_geom, ..geom.clone() })
}
