//! Shapes as Foxglove's scene entities. Each is sent once in the frame it belongs to; the transforms move
//! it.

use std::f32::consts::FRAC_1_SQRT_2;
use std::iter::repeat_n;

use foxglove::messages::{
    Color, CubePrimitive, CylinderPrimitive, ModelPrimitive, Point3, Pose as FoxglovePose, SceneEntity,
    SpherePrimitive, TriangleListPrimitive,
};
use rapier3d::parry::transformation::try_convex_hull;
use serde_json::json;
use tandem_sim::{
    Pose, Vector,
    mjcf::{Geom, Mesh, Primitive},
};

use super::transforms::{quaternion, timestamp, vector3};

/// Side length of the square drawn for a plane without extent.
const ENDLESS_PLANE_M: f32 = 20.0;
const PLANE_THICKNESS_M: f32 = 0.001;
/// Types of numbers in glTF, and the size of the head of a binary file.
const GLTF_F32: u32 = 5126;
const GLTF_U16: u32 = 5123;
const GLTF_U32: u32 = 5125;
const GLB_HEAD_BYTES: u32 = 12;

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
            // A degenerate mesh has no hull, so it is not shown.
            if let Ok((points_m, corners)) = try_convex_hull(vertices_m) {
                entity.triangles.push(triangles(pose, &points_m, &corners, color));
            }
        }
        Primitive::Mesh(mesh) => entity.models.push(model(pose, mesh, color)),
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

/// Returns a mesh as glTF. A list of triangles has twice the bytes, and takes more than twice as long to
/// write.
fn model(pose: Pose, mesh: &Mesh, color: Color) -> ModelPrimitive {
    ModelPrimitive {
        pose: Some(foxglove_pose(pose)),
        scale: Some(vector3(Vector::ONE)),
        color: Some(color),
        override_color: true,
        url: String::new(),
        media_type: "model/gltf-binary".into(),
        data: glb(mesh).into(),
    }
}

/// Returns a mesh as a binary glTF 2.0 file.
fn glb(mesh: &Mesh) -> Vec<u8> {
    let mut numbers: Vec<u8> =
        mesh.vertices_m.iter().flat_map(|p| p.to_array()).flat_map(f32::to_le_bytes).collect();
    let points_bytes = numbers.len();
    let is_short = mesh.vertices_m.len() <= usize::from(u16::MAX);
    for corner in mesh.triangles.iter().flatten() {
        match is_short {
            true => numbers.extend((*corner as u16).to_le_bytes()),
            false => numbers.extend(corner.to_le_bytes()),
        }
    }
    let corners_bytes = numbers.len() - points_bytes;
    numbers.resize(numbers.len().next_multiple_of(4), 0);
    let low_m = mesh.vertices_m.iter().copied().fold(Vector::INFINITY, Vector::min);
    let high_m = mesh.vertices_m.iter().copied().fold(Vector::NEG_INFINITY, Vector::max);
    let mut head = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        // Up is y in glTF, and viewers turn it to z.
        "nodes": [{ "mesh": 0, "rotation": [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": GLTF_F32, "count": mesh.vertices_m.len(), "type": "VEC3",
              "min": low_m.to_array(), "max": high_m.to_array() },
            { "bufferView": 1, "componentType": if is_short { GLTF_U16 } else { GLTF_U32 },
              "count": 3 * mesh.triangles.len(), "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": points_bytes },
            { "buffer": 0, "byteOffset": points_bytes, "byteLength": corners_bytes },
        ],
        "buffers": [{ "byteLength": numbers.len() }],
    })
    .to_string();
    head.extend(repeat_n(' ', head.len().next_multiple_of(4) - head.len()));
    let chunk =
        |kind: &[u8; 4], content: &[u8]| [&(content.len() as u32).to_le_bytes(), kind, content].concat();
    let chunks = [chunk(b"JSON", head.as_bytes()), chunk(b"BIN\0", &numbers)].concat();
    let total_bytes = GLB_HEAD_BYTES + chunks.len() as u32;
    [&b"glTF"[..], &2_u32.to_le_bytes(), &total_bytes.to_le_bytes(), &chunks].concat()
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

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use serde_json::Value;
    use tandem_sim::mjcf::Document;

    use super::*;

    /// Returns the different meshes of a scene.
    fn meshes() -> Vec<Arc<Mesh>> {
        let kitchen = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes/kitchen/handover.xml");
        let trees = Document::read(&kitchen).unwrap().trees().unwrap();
        let geoms = trees.iter().flat_map(|tree| &tree.links).flat_map(|link| &link.geoms);
        let meshes = geoms.filter_map(|geom| match &geom.primitive {
            Primitive::Mesh(mesh) => Some(mesh.clone()),
            _ => None,
        });
        meshes.collect()
    }

    #[test]
    fn a_mesh_is_written_as_binary_gltf() {
        let meshes = meshes();
        assert!(meshes.len() > 5, "{}", meshes.len());
        for mesh in meshes {
            let file = glb(&mesh);
            let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
            assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
            let head = 20..20 + word(12);
            let numbers = &file[head.end + 8..];
            assert_eq!(
                (&file[16..20], word(head.end), &file[head.end + 4..][..4]),
                (&b"JSON"[..], numbers.len(), &b"BIN\0"[..])
            );
            let head: Value = serde_json::from_slice(&file[head]).unwrap();
            assert_eq!(head["buffers"][0]["byteLength"], numbers.len());
            let points: Vec<[f32; 3]> = numbers.as_chunks::<12>().0[..mesh.vertices_m.len()]
                .iter()
                .map(|point| [0, 4, 8].map(|at| f32::from_le_bytes(point[at..at + 4].try_into().unwrap())))
                .collect();
            assert_eq!(points, mesh.vertices_m.iter().map(|point| point.to_array()).collect::<Vec<_>>());
            let first = head["bufferViews"][1]["byteOffset"].as_u64().unwrap() as usize;
            let corners =
                numbers[first..].as_chunks::<2>().0.iter().map(|bytes| u16::from_le_bytes(*bytes).into());
            let expected: Vec<u32> = mesh.triangles.as_flattened().to_vec();
            assert_eq!(corners.take(expected.len()).collect::<Vec<u32>>(), expected);
        }
    }
}
