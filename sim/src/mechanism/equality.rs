//! Equalities of a file between the links of its bodies, links that never touch, and pairs of geoms that do.

use crate::SimError;
use crate::dynamics::{ColliderId, DPose3, Dynamics, Equality, LinkId, TreeId};
use crate::mjcf::{BodyTree, Document, EqualityKind};

/// A tree of a file and its id in dynamics; `None` for a part of the world.
pub(crate) struct PlacedTree<'a> {
    pub tree: &'a BodyTree,
    pub id: Option<TreeId>,
    /// Colliders of the geoms of all links, in their order.
    pub colliders: Vec<Option<ColliderId>>,
}

/// One body of an equality.
#[derive(Clone, Copy)]
struct End {
    /// Link of the body; `None` is the world.
    link: Option<LinkId>,
    /// The body's pose in the frame of the link, or of the world.
    carrier_from_body: DPose3,
    world_from_body: DPose3,
}

/// Adds all equalities of a file whose trees were placed with the file's frame at `world_from_file`.
pub(crate) fn add_equalities(
    dynamics: &mut Dynamics,
    document: &Document,
    placed: &[PlacedTree],
    world_from_file: &DPose3,
) -> Result<(), SimError> {
    for equality in document.equalities()? {
        let end = |body: Option<&String>| end(dynamics, placed, world_from_file, body);
        let found = match &equality.kind {
            EqualityKind::Coupling { joint, other, coefficients } => {
                let leader = other.as_ref().and_then(|name| joint_link(placed, name));
                joint_link(placed, joint).map(|follower| Equality::Couple {
                    follower,
                    leader,
                    polynomial: *coefficients,
                })
            }
            EqualityKind::Weld { body, other, body_from_other } => {
                let (a, b) = (end(Some(body)), end(other.as_ref()));
                let as_placed = a.world_from_body.inverse() * b.world_from_body;
                weld(a, b, body_from_other.unwrap_or(as_placed))
            }
            EqualityKind::Pin { body, other, anchor_in_body_m } => {
                let (a, b) = (end(Some(body)), end(other.as_ref()));
                let world_m = a.world_from_body * *anchor_in_body_m;
                let on = |end: End| end.carrier_from_body * (end.world_from_body.inverse() * world_m);
                let (a, b) = if a.link.is_some() { (a, b) } else { (b, a) };
                let ends =
                    |link| Equality::Connect { a: link, a_point_m: on(a), b: b.link, b_point_m: on(b) };
                a.link.map(ends)
            }
        };
        if let Some(found) = found {
            dynamics.add_equality(found, equality.active);
        }
    }
    Ok(())
}

/// Returns the weld of two ends; `None` between two parts of the world, which need no weld.
fn weld(a: End, b: End, a_from_b: DPose3) -> Option<Equality> {
    let (a, b, a_from_b) = if a.link.is_some() { (a, b, a_from_b) } else { (b, a, a_from_b.inverse()) };
    let between_links = a.carrier_from_body * a_from_b * b.carrier_from_body.inverse();
    a.link.map(|link| Equality::Weld { a: link, a_from_b: between_links, b: b.link })
}

fn end(dynamics: &Dynamics, placed: &[PlacedTree], world_from_file: &DPose3, body: Option<&String>) -> End {
    let world = End { link: None, carrier_from_body: *world_from_file, world_from_body: *world_from_file };
    let Some(name) = body else { return world };
    for PlacedTree { tree, id, .. } in placed {
        let Some((link, in_link)) = tree.body(name) else { continue };
        return match id {
            Some(id) => End {
                link: Some(id.link(link)),
                carrier_from_body: in_link,
                world_from_body: dynamics.tree(*id).world_from_link(link) * in_link,
            },
            None => {
                let world_from_body = *world_from_file * tree.links[link].parent_from_link * in_link;
                End { link: None, carrier_from_body: world_from_body, world_from_body }
            }
        };
    }
    world
}

/// Excludes contacts between the bodies that the file's `<exclude>` names. Two parts of the room never touch
/// anyway.
pub(crate) fn keep_apart(
    dynamics: &mut Dynamics,
    document: &Document,
    placed: &[PlacedTree],
) -> Result<(), SimError> {
    for pair in document.exclusions()? {
        match pair.each_ref().map(|name| excluded(placed, name)) {
            [Some(Excluded::Link(a)), Some(Excluded::Link(b))] => dynamics.keep_apart(a, b),
            [Some(Excluded::Link(link)), Some(Excluded::Room(colliders))]
            | [Some(Excluded::Room(colliders)), Some(Excluded::Link(link))] => {
                for own in dynamics.colliders_on(link) {
                    colliders.iter().for_each(|other| dynamics.keep_colliders_apart(own, *other));
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// Lets the geoms of the file's `<pair>`s touch.
pub(crate) fn pair_up(
    dynamics: &mut Dynamics,
    document: &Document,
    placed: &[PlacedTree],
) -> Result<(), SimError> {
    for pair in &document.pairs {
        let [a, b] = pair.geoms.each_ref().map(|name| paired(placed, name));
        let ([Some(a), Some(b)], true) = ([a, b], pair.geoms[0] != pair.geoms[1]) else {
            let [a, b] = &pair.geoms;
            let what = format!("pair of `{a}` and `{b}`; it takes two geoms that have an extent");
            return Err(document.unsupported(what));
        };
        dynamics.let_touch(a, b, pair.friction);
    }
    Ok(())
}

/// Returns the collider of the geom of this name.
fn paired(placed: &[PlacedTree], name: &str) -> Option<ColliderId> {
    placed.iter().find_map(|PlacedTree { tree, colliders, .. }| {
        let geoms = tree.links.iter().flat_map(|link| &link.geoms).zip(colliders);
        geoms
            .into_iter()
            .find(|(geom, _)| geom.name.as_deref() == Some(name))
            .and_then(|(_, collider)| *collider)
    })
}

/// Body that an `<exclude>` names.
enum Excluded {
    Link(LinkId),
    /// Colliders of a part of the world.
    Room(Vec<ColliderId>),
}

fn excluded(placed: &[PlacedTree], name: &str) -> Option<Excluded> {
    placed.iter().find_map(|PlacedTree { tree, id, colliders }| {
        let (link, _) = tree.body(name)?;
        Some(match id {
            Some(id) => Excluded::Link(id.link(link)),
            None => {
                let body = tree.links[link].bodies.iter().find(|body| body.name == name)?;
                Excluded::Room(colliders[body.geoms.clone()].iter().flatten().copied().collect())
            }
        })
    })
}

/// Returns the link that a joint of a file moves, unless it is part of the world.
pub(super) fn joint_link(placed: &[PlacedTree], joint: &str) -> Option<LinkId> {
    placed.iter().find_map(|PlacedTree { tree, id, .. }| {
        let index = tree.links.iter().position(|link| link.joint.name() == Some(joint))?;
        Some((*id)?.link(index))
    })
}
