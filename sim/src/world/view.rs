//! What cameras see of a world.

use rapier3d::math::{Pose, Vector};

use super::World;
use crate::body::RobotModel;
use crate::mjcf::{Geom, MjcfCamera, Primitive};
use crate::render::{Camera, Instance, Mesh, Pattern, RenderScene};

/// Colours that tell robots apart, in place of the material `accent` of the robot's file.
const ACCENTS: [[f32; 3]; 3] = [[0.12, 0.35, 0.85], [0.95, 0.48, 0.08], [0.15, 0.62, 0.28]];
const ACCENT_MATERIAL: &str = "accent";
/// Around the middle between the robots: counter, objects and all hands.
const FOCUS_HEIGHT_M: f32 = 0.8;
const FOCUS_RADIUS_M: f32 = 1.25;
/// The light stands for lamps at this height: walls and what hangs above them cast no shadow into the room.
const LAMPS_M: f32 = 2.2;
/// Third-person view where a scene's file gives none: from the side, a little above.
const FALLBACK_EYE_M: Vector = Vector::new(0.4, -2.4, 1.6);
const FALLBACK_TARGET_M: Vector = Vector::new(0.4, 0.0, 0.8);
const THIRD_PERSON: &str = "third_person";

/// Instance ids in [`crate::render::Frame::ids`]: 0 background, 1 the room, then robots, then objects.
pub const ROOM_ID: u32 = 1;

impl World {
    /// Everything that is drawn, as it stands now.
    pub fn render_scene(&self) -> RenderScene {
        let mut scene = RenderScene { focus_radius_m: FOCUS_RADIUS_M, ..RenderScene::default() };
        let mut middle_m = Vector::ZERO;
        add(&mut scene, &self.fixed, Pose::IDENTITY, ROOM_ID, rgb);
        for (index, robot) in self.robots.iter().enumerate() {
            let accent = ACCENTS[index % ACCENTS.len()];
            let body = robot.measure(&self.physics);
            middle_m += body.world_from_pelvis().translation / self.robots.len() as f32;
            for (link, world_from_link) in robot.model.links.iter().zip(&body.world_from_link) {
                add(&mut scene, &link.geoms, *world_from_link, self.robot_id(index), |geom| {
                    if geom.material.as_deref() == Some(ACCENT_MATERIAL) { accent } else { rgb(geom) }
                });
            }
        }
        for (index, object) in self.objects.iter().enumerate() {
            let pose = object.state(&self.physics).world_from_object;
            add(&mut scene, &object.geoms, pose, self.object_id(index), rgb);
        }
        scene.focus_m = Vector::new(middle_m.x, middle_m.y, FOCUS_HEIGHT_M);
        scene
    }

    fn robot_id(&self, index: usize) -> u32 {
        ROOM_ID + 1 + index as u32
    }

    fn object_id(&self, index: usize) -> u32 {
        ROOM_ID + 1 + (self.robots.len() + index) as u32
    }

    /// The camera in a robot's head.
    pub fn egocentric_camera(&self, robot: usize) -> Camera {
        let state = self.robot_state(robot);
        let model: &RobotModel = &self.robots[robot].model;
        camera(&model.egocentric, state.world_from_pelvis * state.pelvis_from_camera)
    }

    /// The scene's camera that sees all robots.
    pub fn third_person_camera(&self) -> Camera {
        match self.cameras.iter().find(|camera| camera.name == THIRD_PERSON) {
            Some(found) => camera(found, found.body_from_camera),
            None => Camera {
                world_from_camera: look_at(FALLBACK_EYE_M, FALLBACK_TARGET_M),
                vertical_fov_rad: 50f32.to_radians(),
                width: 640,
                height: 480,
            },
        }
    }
}

fn camera(source: &MjcfCamera, world_from_camera: Pose) -> Camera {
    let (width, height) = source.resolution_px;
    Camera { world_from_camera, vertical_fov_rad: source.vertical_fov_rad, width, height }
}

fn look_at(eye_m: Vector, target_m: Vector) -> Pose {
    Pose::look_at_rh(eye_m, target_m, Vector::Z).inverse()
}

fn rgb(geom: &Geom) -> [f32; 3] {
    [geom.rgba[0], geom.rgba[1], geom.rgba[2]]
}

fn add(
    scene: &mut RenderScene,
    geoms: &[Geom],
    world_from_body: Pose,
    id: u32,
    rgb: impl Fn(&Geom) -> [f32; 3],
) {
    for geom in geoms.iter().filter(|geom| geom.drawn) {
        let mesh = mesh(&geom.primitive);
        let world_from_mesh = world_from_body * geom.body_from_geom;
        let top_m =
            mesh.vertices.iter().map(|vertex| (world_from_mesh * vertex.position_m).z).fold(0.0, f32::max);
        scene.meshes.push(mesh);
        scene.instances.push(Instance {
            mesh: scene.meshes.len() - 1,
            world_from_mesh,
            casts_shadow: top_m < LAMPS_M,
            rgb: rgb(geom),
            pattern: if geom.checkered { Pattern::Checker } else { Pattern::Plain },
            id,
        });
    }
}

fn mesh(primitive: &Primitive) -> Mesh {
    match primitive {
        Primitive::Sphere { radius_m } => Mesh::sphere(*radius_m),
        Primitive::Capsule { radius_m, half_length_m } => Mesh::capsule(*radius_m, *half_length_m),
        Primitive::Cylinder { radius_m, half_length_m } => Mesh::cylinder(*radius_m, *half_length_m),
        Primitive::Box { half_extents_m } => Mesh::cuboid(*half_extents_m),
        Primitive::Ellipsoid { radii_m } => Mesh::ellipsoid(*radii_m),
        Primitive::Plane { half_extents_m } => Mesh::plane(*half_extents_m),
        Primitive::Convex { vertices_m } => {
            let (points_m, triangles) = rapier3d::parry::transformation::convex_hull(vertices_m);
            Mesh::faceted(&points_m, &triangles)
        }
    }
}
