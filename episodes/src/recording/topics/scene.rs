//! Shapes as Foxglove's scene entities. Each is sent once in the frame it belongs to; the transforms move
//! it.

use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, Point3, Pose as FoxglovePose, SceneEntity, SpherePrimitive,
    TriangleListPrimitive,
};
use rapier3d::parry::transformation::try_convex_hull;
use tandem_sim::{
    Pose, Vector,
    mjcf::{Geom, Primitive},
};

use super::transforms::{quaternion, timestamp, vector3};

/// Side of the square as which a plane without extent is drawn.
const ENDLESS_PLANE_M: f32 = 20.0;
const PLANE_THICKNESS_M: f32 = 0.001;

/// Returns the visible shapes of a body, in the body's frame. `recolour` may give a geom another colour
/// than its file's.
pub fn entity(frame: &str, geoms: &[Geom], recolour: impl Fn(&Geom) -> [f32; 4]) -> SceneEntity {
    let mut entity = SceneEntity {
        timestamp: Some(timestamp(0.0)),
        frame_id: frame.into(),
        id: frame.into(),
        frame_locked: true,
        ..SceneEntity::default()
    };
    for geom in geoms.iter().filter(|geom| geom.drawn) {
        add(&mut entity, geom, colour(recolour(geom)));
    }
    entity
}

fn add(entity: &mut SceneEntity, geom: &Geom, color: Color) {
    let pose = geom.body_from_geom;
    match &geom.primitive {
        Primitive::Sphere { radius_m } => {
            entity.spheres.push(sphere(pose, Vector::splat(*radius_m), color));
        }
        Primitive::Ellipsoid { radii_m } => entity.spheres.push(sphere(pose, *radii_m, color)),
        Primitive::Cylinder { radius_m, half_length_m } => {
            entity.cylinders.push(cylinder(pose, *radius_m, *half_length_m, color));
        }
        Primitive::Capsule { radius_m, half_length_m } => {
            entity.cylinders.push(cylinder(pose, *radius_m, *half_length_m, color));
            for end in [-half_length_m, *half_length_m] {
                let end = pose * Pose::from_translation(Vector::new(0.0, 0.0, end));
                entity.spheres.push(sphere(end, Vector::splat(*radius_m), color));
            }
        }
        Primitive::Box { half_extents_m } => entity.cubes.push(cube(pose, *half_extents_m, color)),
        Primitive::Plane { half_extents_m } => {
            let [x, y] = half_extents_m.map(|half| if half > 0.0 { half } else { ENDLESS_PLANE_M / 2.0 });
            // The plane is the slab's upper face.
            let below = pose * Pose::from_translation(Vector::new(0.0, 0.0, -PLANE_THICKNESS_M / 2.0));
            entity.cubes.push(cube(below, Vector::new(x, y, PLANE_THICKNESS_M / 2.0), color));
        }
        Primitive::Convex { vertices_m } => {
            // A degenerate mesh has no hull and nothing to show.
            if let Ok((points_m, corners)) = try_convex_hull(vertices_m) {
                entity.triangles.push(triangles(pose, &points_m, &corners, color));
            }
        }
        Primitive::Mesh(mesh) => {
            entity.triangles.push(triangles(pose, &mesh.vertices_m, &mesh.triangles, color));
        }
    }
}

fn triangles(pose: Pose, points_m: &[Vector], corners: &[[u32; 3]], color: Color) -> TriangleListPrimitive {
    TriangleListPrimitive {
        pose: Some(foxglove_pose(pose)),
        points: points_m.iter().map(|p| Point3 { x: p.x.into(), y: p.y.into(), z: p.z.into() }).collect(),
        indices: corners.iter().flatten().copied().collect(),
        color: Some(color),
        colors: Vec::new(),
    }
}

fn sphere(pose: Pose, radii_m: Vector, color: Color) -> SpherePrimitive {
    SpherePrimitive {
        pose: Some(foxglove_pose(pose)),
        size: Some(vector3(radii_m * 2.0)),
        color: Some(color),
    }
}

fn cylinder(pose: Pose, radius_m: f32, half_length_m: f32, color: Color) -> CylinderPrimitive {
    let size = Vector::new(radius_m, radius_m, half_length_m) * 2.0;
    CylinderPrimitive {
        pose: Some(foxglove_pose(pose)),
        size: Some(vector3(size)),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(color),
    }
}

fn cube(pose: Pose, half_extents_m: Vector, color: Color) -> CubePrimitive {
    CubePrimitive {
        pose: Some(foxglove_pose(pose)),
        size: Some(vector3(half_extents_m * 2.0)),
        color: Some(color),
    }
}

fn foxglove_pose(pose: Pose) -> FoxglovePose {
    FoxglovePose { position: Some(vector3(pose.translation)), orientation: Some(quaternion(pose.rotation)) }
}

fn colour([r, g, b, a]: [f32; 4]) -> Color {
    Color { r: r.into(), g: g.into(), b: b.into(), a: a.into() }
}
