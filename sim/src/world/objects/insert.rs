//! Insertion of scenes and objects into a world.

use std::iter::successors;

use rapier3d::math::Pose;

use super::model::part_name;
use super::{Object, ObjectFile, ObjectModel, ObjectPlacement};
use crate::SimError;
use crate::dynamics::{ColliderId, DVec3, Dynamics, Link, Tree, TreeId};
use crate::mechanism::{
    Machinery, PlacedTree, START, add_collider, add_equalities, begin, keep_apart, links, pair_up, precise,
    rounded,
};
use crate::mjcf::{BodyLink, BodyTree, Document, Geom, LinkJoint};
use crate::owner::Owner;

/// Content of a scene's file in a world.
pub(in crate::world) struct Furniture {
    /// Geoms that do not move, world frame.
    pub fixed: Vec<Geom>,
    pub objects: Vec<Object>,
    pub machinery: Machinery,
}

/// Inserts a scene with its origin at `world_from_scene`. Bodies that no joint moves become the room; the
/// links of the others become objects. All bodies begin in the key `start`, if there is one. Free bodies may
/// sleep if `may_sleep` is true.
pub(in crate::world) fn insert_scene(
    dynamics: &mut Dynamics,
    scene: &Document,
    world_from_scene: &Pose,
    may_sleep: bool,
) -> Result<Furniture, SimError> {
    let world_from_file = precise(world_from_scene);
    let mut fixed = Vec::new();
    let mut objects = Vec::new();
    let trees = scene.trees()?;
    let actuators = scene.actuators()?;
    let mut placed = Vec::with_capacity(trees.len());
    for tree in &trees {
        let mut colliders = Vec::new();
        let id = if tree.is_fixed() {
            for mut geom in tree.links.iter().flat_map(in_file) {
                geom.body_from_geom = *world_from_scene * geom.body_from_geom;
                colliders.push(add_collider(dynamics, &geom, None, None));
                fixed.push(geom);
            }
            None
        } else {
            let name = |link: &BodyLink| link.name.clone();
            let tree_links = links(tree, &world_from_file, &actuators);
            let (id, of_links) = insert_moving(dynamics, tree, tree_links, name, &mut objects)?;
            colliders = of_links;
            Some(id)
        };
        placed.push(PlacedTree { tree, id, colliders });
    }
    // Welds hold bodies in their placed poses, for any initial state.
    add_equalities(dynamics, scene, &placed, &world_from_file)?;
    if may_sleep {
        placed.iter().filter_map(|tree| tree.id).for_each(|id| dynamics.let_sleep(id));
    }
    let machinery = Machinery::of(scene, &placed)?;
    if let Some(start) = scene.keys()?.iter().find(|key| key.name == START) {
        begin(dynamics, &placed, start, &world_from_file);
    }
    keep_apart(dynamics, scene, &placed)?;
    pair_up(dynamics, scene, &placed)?;
    Ok(Furniture { fixed, objects, machinery })
}

/// Inserts an object file: one top-level body, which is a mark if no joint moves it. The body has the
/// placement's name. The names of links on it are this name followed by their own. If the placement names a
/// free body of the scene, that body is moved instead.
pub(in crate::world) fn insert_object(
    dynamics: &mut Dynamics,
    placement: &ObjectPlacement,
    objects: &mut Vec<Object>,
) -> Result<(), SimError> {
    if let ObjectFile::OfScene { .. } = placement.file {
        move_object(dynamics, placement, objects);
        return Ok(());
    }
    let (document, tree) = ObjectModel::read(&placement.file)?;
    let world_from_file = precise(&placement.world_from_object);
    if tree.is_fixed() {
        let owner = Owner::Object(objects.len());
        for mut geom in tree.links.iter().flat_map(in_file) {
            geom.body_from_geom = placement.world_from_object * geom.body_from_geom;
            add_collider(dynamics, &geom, None, Some(owner));
        }
        objects.push(Object {
            name: placement.name.clone(),
            model: ObjectModel::of(&tree.links[0]),
            link: None,
            joint: None,
            world_from_mark: placement.world_from_object * rounded(&tree.links[0].parent_from_link),
        });
        return Ok(());
    }
    let name = |link: &BodyLink| part_name(&placement.name, link);
    let tree_links = links(&tree, &world_from_file, &[]);
    let (id, colliders) = insert_moving(dynamics, &tree, tree_links, name, objects)?;
    let placed = [PlacedTree { tree: &tree, id: Some(id), colliders }];
    add_equalities(dynamics, &document, &placed, &world_from_file)?;
    keep_apart(dynamics, &document, &placed)?;
    pair_up(dynamics, &document, &placed)
}

/// Moves a free body of the scene to its placement, at rest.
fn move_object(dynamics: &mut Dynamics, placement: &ObjectPlacement, objects: &[Object]) {
    if let Some(link) = objects.iter().find(|object| object.name == placement.name).and_then(|one| one.link) {
        let world_from_body = precise(&placement.world_from_object);
        dynamics.tree_mut(link.tree).set_base(world_from_body, DVec3::ZERO, DVec3::ZERO);
    }
}

/// Inserts a tree as objects. Returns it with the colliders of its geoms.
fn insert_moving(
    dynamics: &mut Dynamics,
    tree: &BodyTree,
    links: Vec<Link>,
    name: impl Fn(&BodyLink) -> String,
    objects: &mut Vec<Object>,
) -> Result<(TreeId, Vec<Option<ColliderId>>), SimError> {
    let mut colliders = Vec::new();
    let id = dynamics.add_tree(Tree::new(&name(&tree.links[0]), links)?);
    for (index, link) in tree.links.iter().enumerate() {
        let owner = Owner::Object(objects.len());
        for geom in &link.geoms {
            colliders.push(add_collider(dynamics, geom, Some(id.link(index)), Some(owner)));
        }
        objects.push(Object {
            name: name(link),
            model: ObjectModel::of(link),
            link: Some(id.link(index)),
            joint: link.joint.name().map(String::from),
            world_from_mark: Pose::IDENTITY,
        });
        if let Some(carrier) = carrier(tree, index) {
            dynamics.keep_apart(id.link(index), id.link(carrier));
        }
    }
    Ok((id, colliders))
}

/// Returns the link that carries another by several joints, if it can move. These two links never touch, as
/// with a single joint.
fn carrier(tree: &BodyTree, link: usize) -> Option<usize> {
    let above = |link: usize| tree.links[link].parent;
    let first_part = above(link).filter(|parent| tree.links[*parent].is_part)?;
    let carrier = successors(Some(first_part), |part| above(*part)).find(|one| !tree.links[*one].is_part)?;
    let moves = |link: &usize| tree.links[*link].joint != LinkJoint::Fixed;
    successors(Some(carrier), |one| above(*one)).any(|one| moves(&one)).then_some(carrier)
}

/// Returns the geoms of a link that does not move, in the frame of its file.
fn in_file(link: &BodyLink) -> impl Iterator<Item = Geom> {
    let file_from_link = rounded(&link.parent_from_link);
    link.geoms
        .iter()
        .map(move |geom| Geom { body_from_geom: file_from_link * geom.body_from_geom, ..geom.clone() })
}
