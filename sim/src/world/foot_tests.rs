//! Tests of feet against obstacles on the floor: toes do not pass through table legs, bottles and other feet.

use std::f32::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::parry::query;
use rapier3d::prelude::SharedShape;

use super::{ObjectModel, SceneSource, World, WorldSpec};
use crate::body::RobotModel;
use crate::dynamics::{Axis, DVec3, Drive, Dynamics, Joint, Link, Mass, Settings, Tree};
use crate::mechanism::{add_collider, precise, rounded};
use crate::mjcf::{Document, Geom};
use crate::{RobotPlacement, assets};

/// Maximum depth of a foot's drawn shape in an obstacle: contacts yield a little, and collision shapes
/// are simpler than drawn ones.
const DRAWN_M: f32 = 0.004;
/// Height of the ankle of a planted foot.
const ANKLE_M: f32 = 0.035;
/// A leg of a table, 28 mm square.
const TABLE_LEG: &str = r#"<geom type="box" size="0.014 0.014 0.15" pos="0 0 0.15"/>"#;

fn robot() -> RobotModel {
    RobotModel::parse("robot.xml", assets::robot(assets::DEFAULT_ROBOT).expect("embedded")).expect("a robot")
}

/// Returns the geoms of a foot in the frame of its link.
fn foot(robot: &RobotModel) -> &[Geom] {
    &robot.links[robot.soles.left.link].geoms
}

fn room(geoms: &str) -> Document {
    Document::parse("room", &format!("<mujoco><worldbody>{geoms}</worldbody></mujoco>")).expect("a room")
}

fn drawn(world_from_body: &Pose, geoms: &[Geom]) -> Vec<(Pose, SharedShape)> {
    let shapes = geoms.iter().filter(|geom| geom.drawn).filter_map(Geom::collider);
    shapes.map(|(body_from_shape, shape)| (*world_from_body * body_from_shape, shape)).collect()
}

/// Returns the maximum depth of convex shapes in others.
fn depth_m(shapes: &[(Pose, SharedShape)], others: &[(Pose, SharedShape)]) -> f32 {
    let pairs = shapes.iter().flat_map(|shape| others.iter().map(move |other| (shape, other)));
    let depths_m = pairs.map(|((pose, shape), (other_pose, other))| {
        let contact = query::contact(pose, &**shape, other_pose, &**other, 0.0).expect("Parry knows both");
        contact.map_or(0.0, |contact| -contact.dist)
    });
    depths_m.fold(0.0, f32::max)
}

/// Returns the obstacle for a toe, turned about the vertical.
fn obstacle(name: &str, robot: &RobotModel, yaw_rad: f32) -> Vec<Geom> {
    let (geoms, height_m) = match name {
        "another foot" => (foot(robot).to_vec(), ANKLE_M),
        "table leg" => (room(TABLE_LEG).trees().expect("a room").remove(0).links.remove(0).geoms, 0.0),
        file => (ObjectModel::parts(&file.into(), file).expect("an object").remove(0).model.geoms, 0.0),
    };
    let place = Pose::from_parts(Vector::Z * height_m, Rotation::from_rotation_z(yaw_rad));
    geoms.into_iter().map(|geom| Geom { body_from_geom: place * geom.body_from_geom, ..geom }).collect()
}

/// Pushes a foot with 100 N for two seconds along a rail, toe first, beside the middle of an obstacle.
/// Returns its maximum depth and its final position.
fn pushed_m(robot: &RobotModel, obstacle: &[Geom], across_m: f32) -> [f32; 2] {
    let mut dynamics = Dynamics::new(Settings::new(0.005, DVec3::ZERO));
    let link = Link {
        name: "foot".into(),
        parent: None,
        parent_from_link: precise(&Pose::from_translation(Vector::new(-0.35, across_m, ANKLE_M))),
        joint: Joint::Slide(Axis::along(DVec3::X)),
        mass: Mass::from_rapier(&robot.links[robot.soles.left.link].mass),
    };
    let id = dynamics.add_tree(Tree::new("foot", vec![link]).expect("a tree"));
    foot(robot).iter().for_each(|geom| {
        add_collider(&mut dynamics, geom, Some(id.link(0)), None);
    });
    obstacle.iter().for_each(|geom| {
        add_collider(&mut dynamics, geom, None, None);
    });
    dynamics.tree_mut(id).drive(0, Drive { feedforward: 100.0, kd: 200.0, ..Drive::NONE });
    let others = drawn(&Pose::IDENTITY, obstacle);
    let mut deepest_m = 0.0_f32;
    for _ in 0..400 {
        dynamics.step().expect("it stays finite");
        let world_from_foot = rounded(&dynamics.tree(id).world_from_link(0));
        deepest_m = deepest_m.max(depth_m(&drawn(&world_from_foot, foot(robot)), &others));
    }
    [deepest_m, dynamics.tree(id).world_from_link(0).translation.x as f32]
}

#[test]
fn a_toe_that_is_pushed_against_something_stays_out_of_it() {
    let robot = robot();
    // The drawn shape of a foot goes from 0.068 m behind the ankle to 0.138 m before it, and 0.036 m to
    // each side. Corners of two feet pass each other where these are 3 cm apart sideways.
    for (name, yaw_rad, across_m, rest_m) in [
        ("table leg", 0.0, 0.0, -0.152),
        ("table leg", 0.0, 0.012, -0.152),
        ("bottle", 0.0, 0.0, -0.173),
        ("another foot", PI, 0.03, -0.25),
        ("another foot", 0.0, 0.0, -0.206),
        ("another foot", FRAC_PI_2, 0.035, -0.174),
    ] {
        let [deepest_m, x_m] = pushed_m(&robot, &obstacle(name, &robot, yaw_rad), across_m);
        let found = format!("{name} at {yaw_rad}, {across_m} m beside: {deepest_m} m deep, rests at {x_m} m");
        println!("{found}");
        assert!(deepest_m < DRAWN_M && (x_m - rest_m).abs() < 0.03, "{found}");
    }
}

/// Walks a robot with its left foot against a fixed post at this distance, too low for the knees to meet
/// it. Returns the maximum depth of its feet in the post.
fn walked_m(robot: RobotModel, ahead_m: f32) -> f32 {
    let robot = Arc::new(robot);
    let post = format!(r#"<geom type="box" size="0.014 0.014 0.05" pos="{ahead_m} 0.12 0.05"/>"#);
    let scene = room(&format!(r#"<geom type="plane" size="3 3 0.1"/>{post}"#));
    let placement = RobotPlacement { name: "A".into(), position_m: [0.0; 2], yaw_rad: 0.0 };
    let spec = WorldSpec {
        scene: SceneSource::Read { document: scene.into(), world_from_scene: Pose::IDENTITY },
        robots: vec![placement],
        objects: Vec::new(),
    };
    let mut world = World::with_robot(&spec, robot.clone()).expect("a world");
    let post = drawn(&Pose::IDENTITY, &world.room()[1..]);
    let rest = world.rest_command(0);
    let mut deepest_m = 0.0_f32;
    for _ in 0..200 {
        let mut command = rest;
        command.base.vx_m_s = 0.3;
        let step = world.control_step(&[command]).expect("it stays finite");
        for sole in robot.soles.iter() {
            let world_from_foot = step.robots[0].truth.world_from_link[sole.link];
            let foot = drawn(&world_from_foot, &robot.links[sole.link].geoms);
            deepest_m = deepest_m.max(depth_m(&foot, &post));
        }
    }
    deepest_m
}

#[test]
fn a_robot_that_walks_against_a_post_keeps_its_feet_out_of_it() {
    // A foot with only its standing corners goes through a post at its foothold.
    let ours = assets::robot(assets::DEFAULT_ROBOT).expect("embedded");
    let corners = ours.replace(r#"<geom class="collision" type="mesh" mesh="foot_shell"/>"#, "");
    assert_ne!(ours, corners);
    let through = |ahead_m| {
        let robot = RobotModel::parse("robot.xml", &corners).expect("a robot");
        (walked_m(robot, ahead_m), ahead_m)
    };
    let places = [0.24, 0.28, 0.32, 0.36, 0.40].map(through);
    let (through_m, ahead_m) =
        places.into_iter().max_by(|one, other| one.0.total_cmp(&other.0)).expect("five");
    // The collision shape ends 4.5 mm above the drawn sole, which shows where a foot comes down on the post.
    let deepest_m = walked_m(robot(), ahead_m);
    println!("{places:?}: {deepest_m} m at {ahead_m} m");
    assert!(deepest_m < DRAWN_M + 0.0055, "{deepest_m} m at {ahead_m} m");
    assert!(through_m > 2.0 * deepest_m && through_m > 0.01, "{through_m} m at {ahead_m} m");
}
