//! Compact geometry of a scene: equal meshes are stored once, vertices as f32, normals as bytes.

use std::collections::HashMap;

use serde_json::{Value, json};
use tandem_sim::Pose;
use tandem_sim::render::{Carrier, Part, Pattern, Scenery, TriangleMesh};

/// Geometry that a page draws: `meshes` and `parts` for the header of a message, and the numbers that
/// follow it.
pub struct Geometry {
    pub meshes: Value,
    pub parts: Value,
    /// For each mesh, little-endian: its vertices (three f32 each, m), its triangles (three u32 each),
    /// and its normals (three i8 scaled by 127, and a padding byte).
    pub numbers: Vec<u8>,
}

/// Returns a pose as x, y, z (m) and the quaternion x, y, z, w, in the order of three.js.
pub fn pose_row(pose: &Pose) -> [f32; 7] {
    let ([x, y, z], [i, j, k, w]) = (pose.translation.to_array(), pose.rotation.to_array());
    [x, y, z, i, j, k, w]
}

impl Geometry {
    pub fn of(scenery: &Scenery) -> Geometry {
        let mut numbers = Vec::new();
        let mut meshes = Vec::new();
        let mut known: HashMap<Vec<u8>, usize> = HashMap::new();
        let parts = scenery.parts.iter().map(|part| {
            let bytes = mesh_bytes(&part.mesh);
            let mesh = *known.entry(bytes).or_insert_with_key(|bytes| {
                numbers.extend_from_slice(bytes);
                meshes.push(json!([part.mesh.vertices.len(), part.mesh.triangles.len()]));
                meshes.len() - 1
            });
            part_row(part, mesh)
        });
        let parts = parts.collect();
        Geometry { parts, meshes: meshes.into(), numbers }
    }
}

fn part_row(part: &Part, mesh: usize) -> Value {
    let carrier = match part.carrier {
        Carrier::Room => json!({ "kind": "room" }),
        Carrier::Link { robot, link } => json!({ "kind": "link", "robot": robot, "link": link }),
        Carrier::Object(object) => json!({ "kind": "object", "object": object }),
    };
    let (pattern, second) = match part.pattern {
        Pattern::Plain => ("plain", None),
        Pattern::Checker(rgb) => ("checker", Some(rgb)),
        Pattern::Wood => ("wood", None),
        Pattern::Fabric => ("fabric", None),
        Pattern::Print => ("print", None),
    };
    json!({
        "mesh": mesh, "carrier": carrier, "pose": pose_row(&part.carrier_from_mesh), "rgb": part.rgb,
        "alpha": part.alpha, "pattern": pattern, "second_rgb": second, "casts_shadow": part.casts_shadow,
    })
}

fn mesh_bytes(mesh: &TriangleMesh) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(16 * mesh.vertices.len() + 12 * mesh.triangles.len());
    for vertex in &mesh.vertices {
        bytes.extend(vertex.position_m.to_array().into_iter().flat_map(f32::to_le_bytes));
    }
    bytes.extend(mesh.triangles.iter().flatten().flat_map(|corner| corner.to_le_bytes()));
    for vertex in &mesh.vertices {
        bytes.extend(vertex.normal.to_array().map(|part| (part * 127.0).round() as i8 as u8));
        bytes.push(0);
    }
    bytes
}
