//! Worlds and parts for tests of renderers.

use std::f32::consts::PI;

use rapier3d::math::{Pose, Vector};

use super::{Carrier, Part, Pattern, TriangleMesh};
use crate::mjcf::Gloss;
use crate::{ObjectPlacement, RobotPlacement, World, WorldSpec};

/// Returns a box that is part of the room.
pub fn cuboid(half_m: Vector, at_m: Vector, rgb: [f32; 3]) -> Part {
    Part {
        mesh: TriangleMesh::cuboid(half_m).into(),
        carrier: Carrier::Room,
        carrier_from_mesh: Pose::from_translation(at_m),
        rgb,
        alpha: 1.0,
        gloss: Gloss::default(),
        image: None,
        pattern: Pattern::Plain,
        id: 1,
        casts_shadow: true,
    }
}

/// Returns a bottle between the robots of [`world`].
pub fn bottle() -> ObjectPlacement {
    ObjectPlacement {
        name: "bottle".into(),
        file: "bottle".into(),
        world_from_object: Pose::from_translation(Vector::new(0.30, -0.07, 0.80)),
    }
}

/// Returns a scene with two robots that face each other.
pub fn world(scene: &str, objects: Vec<ObjectPlacement>) -> World {
    let robot = |name: &str, position_m: [f32; 2], yaw_rad: f32| RobotPlacement {
        name: name.into(),
        position_m,
        yaw_rad,
    };
    let robots = vec![robot("A", [0.0, 0.0], 0.0), robot("B", [0.74, -0.12], PI)];
    World::new(&WorldSpec { scene: scene.into(), robots, objects }).expect("embedded files")
}
