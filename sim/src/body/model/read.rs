//! Parsing of a robot's file: a mechanism, and the layout of a robot on top of it. The layout consists of the
//! joints and their order, hands, soles, camera and stance.

use std::collections::BTreeSet;

use rapier3d::math::{Pose, Vector};

use super::joints::joints_of_file;
use super::{BodyScale, HandLinks, JointModel, LinkModel, RobotModel, SiteModel};
use crate::body::layout::{HAND_JOINTS, HANDS, LEG_JOINTS, LEGS, THUMB_JOINTS};
use crate::mechanism::Solid;
use crate::mjcf::{BodyTree, Document, Geom, LinkJoint, MjcfCamera, pose};
use crate::{Side, Sides, SimError};

/// Height above a foot's lowest point up to which its corners belong to the sole.
const SOLE_M: f32 = 0.002;
/// Middle of the palm in the frame of a wrist, whose x axis points along the fingers.
pub(super) const PALM_IN_WRIST_M: Vector = Vector::new(0.12, 0.0, 0.0);

impl RobotModel {
    /// Reads a robot's MJCF: see [`RobotModel::of`].
    ///
    /// # Errors
    ///
    /// Returns an error if the text is not MJCF or does not describe a robot.
    pub fn parse(file: &str, xml: &str) -> Result<RobotModel, SimError> {
        RobotModel::of(&Document::parse(file, xml)?)
    }

    /// Builds a robot from a document that meets the requirements. These are one free root body, hinges with
    /// position actuators and the published joint names, and sites `left_wrist`, `right_wrist`, `left_foot`
    /// and `right_foot`. A camera `egocentric` and a first keyframe for the stance are also required. Waist,
    /// arms and hands may lack joints.
    ///
    /// # Errors
    ///
    /// Returns an error that names the first requirement that the document does not meet.
    pub fn of(document: &Document) -> Result<RobotModel, SimError> {
        let tree = only_tree(document)?;
        let joints = joints_of_file(document, &tree)?;
        let soles = sites(document, &tree, "foot", "at the sole's centre")?;
        assemble(document, &tree, joints, soles)
    }
}

/// Builds a robot from a tree whose joints and soles are known.
pub(super) fn assemble(
    document: &Document,
    tree: &BodyTree,
    joints: Vec<JointModel>,
    soles: Sides<SiteModel>,
) -> Result<RobotModel, SimError> {
    let links = links(document, tree, &joints)?;
    let (egocentric, egocentric_link) = camera(document, tree)?;
    let wrists = sites(document, tree, "wrist", "where tasks put the hand")?;
    Ok(RobotModel {
        leg_chains: LEGS.map(|first| leg_chain(&joints, first)),
        mass_kg: links.iter().map(|link| link.mass.mass()).sum(),
        scale: BodyScale::G1,
        egocentric,
        egocentric_link,
        sole_corners_m: soles.each_ref().map(|sole| corners_m(&links[sole.link].geoms)),
        soles,
        imu_in_pelvis_m: imu_in_pelvis_m(tree),
        excluded: excluded(document, tree)?,
        hands: Sides::from_fn(|side| hand(&joints, side, &wrists[side])),
        wrists,
        links,
        joints,
        approximations: document.approximations().to_vec(),
    })
}

/// Returns the existing joints of a leg, in the order of the tree; `first` is the first joint in published
/// order.
fn leg_chain(joints: &[JointModel], first: usize) -> Vec<usize> {
    let mut chain: Vec<usize> = (first..first + LEG_JOINTS).filter(|joint| joints[*joint].exists()).collect();
    chain.sort_by_key(|joint| joints[*joint].link);
    chain
}

/// Returns the tree of a robot. Other content of the file is an error, since it would not be added to a world
/// with the robot.
pub(super) fn only_tree(document: &Document) -> Result<BodyTree, SimError> {
    let mut trees = document.trees()?.into_iter();
    let world = trees.next().into_iter().flat_map(|world| world.links);
    let (Some(tree), None) = (trees.next(), trees.next()) else {
        return Err(document.unsupported("a robot is one body in the worldbody, with all others on it"));
    };
    if !matches!(tree.links[0].joint, LinkJoint::Free { .. }) {
        let name = &tree.links[0].name;
        return Err(document.unsupported(format!("a robot is free to move; give `{name}` a <freejoint>")));
    }
    for link in &tree.links {
        let placed_at = match &link.joint {
            LinkJoint::Hinge(axis) | LinkJoint::Slide(axis) => axis.placed_at,
            LinkJoint::Fixed | LinkJoint::Free { .. } => 0.0,
        };
        if link.is_part || placed_at != 0.0 {
            let what =
                format!("a robot's bodies have one joint each, without `ref`; `{}` has not", link.name);
            return Err(document.unsupported(what));
        }
    }
    if world.into_iter().any(|link| !link.geoms.is_empty() || !link.sites.is_empty()) {
        return Err(document.unsupported("a robot has its geoms and sites on bodies, none in the worldbody"));
    }
    if !document.equalities()?.is_empty() {
        return Err(document.unsupported("a robot has no equalities; every joint of it has its actuator"));
    }
    Ok(tree)
}

fn links(document: &Document, tree: &BodyTree, joints: &[JointModel]) -> Result<Vec<LinkModel>, SimError> {
    let read = |(index, link): (usize, &crate::mjcf::BodyLink)| {
        let joint = joints.iter().position(|joint| joint.exists() && joint.link == index);
        if joint.is_none() && link.parent.is_some() {
            let joint = link.joint.name().unwrap_or_default();
            let what = format!("joint `{joint}` of `{}` has no <position> actuator", link.name);
            return Err(document.unsupported(what));
        }
        Ok(LinkModel {
            name: link.name.clone(),
            parent: link.parent,
            parent_from_link: pose(&link.parent_from_link),
            joint,
            mass: link.mass,
            solid: Solid::of(&link.geoms),
            geoms: link.geoms.clone(),
        })
    };
    tree.links.iter().enumerate().map(read).collect()
}

/// Returns the camera in the head, and the link that carries it.
pub(super) fn camera(document: &Document, tree: &BodyTree) -> Result<(MjcfCamera, usize), SimError> {
    let camera = document.cameras.iter().find(|camera| camera.name == "egocentric");
    let needed = || document.unsupported("needs a <camera name=\"egocentric\"> in the head");
    let body = camera.and_then(|camera| tree.body(camera.body.as_deref()?));
    let (Some(camera), Some((link, link_from_body))) = (camera, body) else { return Err(needed()) };
    let body_from_camera = pose(&link_from_body) * camera.body_from_camera;
    Ok((MjcfCamera { body_from_camera, ..camera.clone() }, link))
}

/// Returns the sites `left_NAME` and `right_NAME`.
pub(super) fn sites(
    document: &Document,
    tree: &BodyTree,
    name: &str,
    meaning: &str,
) -> Result<Sides<SiteModel>, SimError> {
    let site = |side: Side| {
        let name = format!("{}_{name}", side.name());
        let on = |(link, site): (usize, Pose)| SiteModel { link, link_from_site: site };
        let links = tree.links.iter().enumerate();
        let mut all = links.flat_map(|(link, on)| on.sites.iter().map(move |site| (link, site)));
        let found =
            all.find(|(_, site)| site.name == name).map(|(link, site)| on((link, site.body_from_site)));
        found.ok_or_else(|| document.unsupported(format!("needs a site `{name}` {meaning}")))
    };
    Ok(Sides { left: site(Side::Left)?, right: site(Side::Right)? })
}

/// Returns the points of a foot that rest on the floor: the lowest point of a sphere, and the lower corners
/// of the box of any other shape. Points of shapes that end higher are left out.
pub(super) fn corners_m(geoms: &[Geom]) -> Vec<Vector> {
    let colliding = geoms.iter().filter(|geom| geom.collides).filter_map(Geom::collider);
    let corners = colliding.flat_map(|(link_from_shape, shape)| match shape.as_ball() {
        Some(ball) => vec![link_from_shape.translation - Vector::Z * ball.radius],
        None => {
            let (low, high) = {
                let bounds = shape.compute_aabb(&link_from_shape);
                (bounds.mins, bounds.maxs)
            };
            [low.x, high.x].iter().flat_map(|x| [low.y, high.y].map(|y| Vector::new(*x, y, low.z))).collect()
        }
    });
    let mut corners_m: Vec<Vector> = corners.collect();
    let lowest_m = corners_m.iter().map(|corner_m| corner_m.z).fold(f32::INFINITY, f32::min);
    corners_m.retain(|corner_m| corner_m.z <= lowest_m + SOLE_M);
    corners_m
}

fn imu_in_pelvis_m(tree: &BodyTree) -> Vector {
    let imu = tree.links[0].sites.iter().find(|site| site.name == "imu");
    imu.map_or(Vector::ZERO, |site| site.body_from_site.translation)
}

/// Returns link pairs that never touch: those that the file names, and neighbours.
fn excluded(document: &Document, tree: &BodyTree) -> Result<BTreeSet<(usize, usize)>, SimError> {
    let mut excluded = BTreeSet::new();
    for pair in document.exclusions()? {
        if let [Some((a, _)), Some((b, _))] = pair.map(|name| tree.body(&name)) {
            excluded.insert((a.min(b), a.max(b)));
        }
    }
    let parents = tree.links.iter().enumerate();
    excluded.extend(parents.filter_map(|(child, link)| link.parent.map(|parent| (parent, child))));
    Ok(excluded)
}

/// Returns the links that fingers move, in the order of links, and the palm's position in the wrist's frame.
fn hand(joints: &[JointModel], side: Side, wrist: &SiteModel) -> HandLinks {
    let (thumb, fingers) = joints[HANDS[side]..HANDS[side] + HAND_JOINTS].split_at(THUMB_JOINTS);
    let links = |joints: &[JointModel]| {
        let moved: BTreeSet<usize> =
            joints.iter().filter(|joint| joint.exists()).map(|joint| joint.link).collect();
        moved.into_iter().collect()
    };
    HandLinks {
        wrist: wrist.link,
        palm_in_wrist_m: wrist.link_from_site * PALM_IN_WRIST_M,
        thumb: links(thumb),
        fingers: links(fingers),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets;

    /// Returns the error for the embedded robot's file with `from` replaced by `to`.
    #[track_caller]
    fn refusal(from: &str, to: &str) -> String {
        let text = assets::robot(assets::DEFAULT_ROBOT).expect("embedded");
        assert!(text.contains(from), "{from}");
        let other = text.replacen(from, to, 1);
        RobotModel::parse("robot.xml", &other).err().map_or(String::new(), |error| error.to_string())
    }

    #[test]
    fn a_foot_stands_on_the_corners_that_are_lowest() {
        let text = assets::robot(assets::DEFAULT_ROBOT).expect("embedded");
        let robot = RobotModel::parse("robot.xml", text).expect("a robot");
        for corners_m in robot.sole_corners_m.iter() {
            assert_eq!(corners_m.len(), 4, "what meets furniture ends higher: {corners_m:?}");
            assert!(corners_m.iter().all(|corner_m| (corner_m.z + 0.035).abs() < 1e-6), "{corners_m:?}");
        }
    }

    #[test]
    fn what_a_robot_cannot_have_is_refused() {
        let knee = r#"<joint name="left_knee_joint" "#;
        let actuator = r#"joint="left_knee_joint" "#;
        let end = "</mujoco>";
        for (from, to, expected) in [
            (knee, r#"<joint name="left_knee_joint" damping="1" "#, "has a spring or a damper"),
            (knee, r#"<joint name="left_knee_joint" pos="0 0 1" "#, "turns beside its body's origin"),
            (knee, r#"<joint name="left_knee_joint" limited="false" "#, "needs a range"),
            (knee, r#"<joint name="left_knee_joint" type="slide" "#, "is no hinge"),
            (actuator, r#"joint="left_knee_joint" ctrlrange="-1 1" "#, "leave out the actuator's ctrlrange"),
            (actuator, r#"joint="left_knee_joint" forcelimited="false" "#, "needs a forcerange"),
            (r#"forcerange="-"#, r#"forcerange="-1"#, "is stronger one way"),
            (r#"kp="200" kv="6""#, r#"kp="200""#, "needs a kp and a kv"),
            (end, "<worldbody><geom size=\"1\"/></worldbody></mujoco>", "none in the worldbody"),
            (end, "<worldbody><body><geom size=\"1\"/></body></worldbody></mujoco>", "all others on it"),
            (end, "<equality><weld body1=\"pelvis\"/></equality></mujoco>", "a robot has no equalities"),
            (
                end,
                "<contact><exclude body1=\"pelvis\" body2=\"hip\"/></contact></mujoco>",
                "exclude of `hip`",
            ),
        ] {
            let error = refusal(from, to);
            assert!(error.contains(expected) && error.starts_with("`robot.xml"), "{to}: {error}");
        }
    }
}
