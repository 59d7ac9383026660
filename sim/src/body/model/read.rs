//! A robot's file: a mechanism as any other, and on top of it the layout of a robot: which joints its actuators move and in
//! which order, where hands and soles are, where it sees from, how it stands.

use std::collections::BTreeSet;

use rapier3d::math::{Pose, Vector};

use super::{HandLinks, JointModel, LinkModel, RobotModel, SiteModel};
use crate::mechanism::Solid;
use crate::mjcf::{Actuator, ActuatorKind, AxisJoint, BodyTree, Document, Geom, LinkJoint, MjcfCamera, pose};
use crate::{Side, Sides, SimError};

/// A foot stands on what is lowest of it, to within this.
const SOLE_M: f32 = 0.002;

impl RobotModel {
    /// Reads a robot file: one free root body, hinges with position actuators, sites `left_wrist`, `right_wrist`,
    /// `left_foot`, `right_foot`, a camera `egocentric` and a first keyframe to stand in.
    pub fn parse(file: &str, xml: &str) -> Result<RobotModel, SimError> {
        let document = &Document::parse(file, xml)?;
        let tree = only_tree(document)?;
        let joints = joints(document, &tree)?;
        let links = links(document, &tree, &joints)?;
        let (egocentric, egocentric_link) = camera(document, &tree)?;
        let wrists = sites(document, &tree, "wrist", "where tasks put the hand")?;
        let soles = sites(document, &tree, "foot", "at the sole's centre")?;
        Ok(RobotModel {
            mass_kg: links.iter().map(|link| link.mass.mass()).sum(),
            egocentric,
            egocentric_link,
            wrists,
            sole_corners_m: soles.each_ref().map(|sole| corners_m(&links[sole.link].geoms)),
            soles,
            imu_in_pelvis_m: imu_in_pelvis_m(&tree),
            excluded: excluded(document, &tree)?,
            hands: Sides::from_fn(|side| hand(&links, side, wrists[side].link)),
            links,
            joints,
            approximations: document.approximations().to_vec(),
        })
    }
}

/// The tree that a robot is. What a file has beside it would not come along when the robot is put into a world.
fn only_tree(document: &Document) -> Result<BodyTree, SimError> {
    let mut trees = document.trees()?.into_iter();
    let world = trees.next().into_iter().flat_map(|world| world.links);
    let (Some(tree), None) = (trees.next(), trees.next()) else {
        return Err(document.unsupported("a robot is one body in the worldbody, with all others on it"));
    };
    if !matches!(tree.links[0].joint, LinkJoint::Free { .. }) {
        let name = &tree.links[0].name;
        return Err(document.unsupported(format!("a robot is free to move; give `{name}` a <freejoint>")));
    }
    if world.into_iter().any(|link| !link.geoms.is_empty() || !link.sites.is_empty()) {
        return Err(document.unsupported("a robot has its geoms and sites on bodies, none in the worldbody"));
    }
    if !document.equalities()?.is_empty() {
        return Err(document.unsupported("a robot has no equalities; every joint of it has its actuator"));
    }
    Ok(tree)
}

/// Joints in the order of the actuators.
fn joints(document: &Document, tree: &BodyTree) -> Result<Vec<JointModel>, SimError> {
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
        // Before a joint's own coordinate there are seven of the root, and one of each joint before it.
        let rest_rad = rest.get(6 + link).copied().unwrap_or(0.0) as f32;
        let joint = match &tree.links[link].joint {
            LinkJoint::Hinge(joint) => joint_model(joint, &actuator, link, rest_rad),
            LinkJoint::Slide(_) | LinkJoint::Free { .. } | LinkJoint::Fixed => Err("is no hinge; use hinges"),
        };
        joints.push(joint.map_err(refuse)?);
    }
    Ok(joints)
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

fn links(document: &Document, tree: &BodyTree, joints: &[JointModel]) -> Result<Vec<LinkModel>, SimError> {
    let read = |(index, link): (usize, &crate::mjcf::BodyLink)| {
        let joint = joints.iter().position(|joint| joint.link == index);
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

/// The camera in the head, and the link that carries it.
fn camera(document: &Document, tree: &BodyTree) -> Result<(MjcfCamera, usize), SimError> {
    let camera = document.cameras.iter().find(|camera| camera.name == "egocentric");
    let needed = || document.unsupported("needs a <camera name=\"egocentric\"> in the head");
    let body = camera.and_then(|camera| tree.body(camera.body.as_deref()?));
    let (Some(camera), Some((link, link_from_body))) = (camera, body) else { return Err(needed()) };
    let body_from_camera = pose(&link_from_body) * camera.body_from_camera;
    Ok((MjcfCamera { body_from_camera, ..camera.clone() }, link))
}

/// The sites `left_NAME` and `right_NAME`.
fn sites(
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

/// What of a foot stands on the floor: of a sphere its lowest point, of anything else the lower corners of its box; without those of
/// shapes that end higher.
fn corners_m(geoms: &[Geom]) -> Vec<Vector> {
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

/// Link pairs that never touch: those that the file names, and neighbours.
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

fn hand(links: &[LinkModel], side: Side, wrist: usize) -> HandLinks {
    let mut hand = HandLinks { wrist, ..HandLinks::default() };
    for (index, link) in links.iter().enumerate().filter(|(_, link)| link.name.starts_with(side.name())) {
        if link.name.contains("hand_thumb") {
            hand.thumb.push(index);
        } else if link.name.contains("hand_") {
            hand.fingers.push(index);
        }
    }
    hand
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets;

    /// Why the embedded robot is refused once `from` in its file has become `to`.
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
