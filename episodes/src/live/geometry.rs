//! Compact geometry of a scene: equal meshes are stored once, vertices as f32, normals as bytes.

use std::collections::HashMap;

use serde_json::{Value, json};
use tandem_sim::Pose;
use tandem_sim::mjcf::{Gloss, SurfaceImage, TextureMapping};
use tandem_sim::render::{Carrier, Part, Pattern, Scenery, TriangleMesh};

use super::textures::SceneTextures;

/// Geometry that a page draws: `meshes` and `parts` for the header of a message, and the numbers that
/// follow it.
pub struct Geometry {
    /// For each mesh, the numbers of its vertices and of its triangles, and 1 if it has texture coordinates.
    pub meshes: Value,
    pub parts: Value,
    /// For each mesh, little-endian: its vertices (three f32 each, m), its triangles (three u32 each),
    /// its normals (three i8 scaled by 127, and a padding byte), and its texture coordinates (two f32 each) if
    /// it has any.
    pub numbers: Vec<u8>,
}

/// Returns a pose as x, y, z (m) and the quaternion x, y, z, w, in the order of three.js.
pub fn pose_row(pose: &Pose) -> [f32; 7] {
    let ([x, y, z], [i, j, k, w]) = (pose.translation.to_array(), pose.rotation.to_array());
    [x, y, z, i, j, k, w]
}

/// Returns the carrier of a shape or a light, for pages.
pub fn carrier_row(carrier: Carrier) -> Value {
    match carrier {
        Carrier::Room => json!({ "kind": "room" }),
        Carrier::Link { robot, link } => json!({ "kind": "link", "robot": robot, "link": link }),
        Carrier::Object(object) => json!({ "kind": "object", "object": object }),
    }
}

impl Geometry {
    /// Returns the geometry of a scene, whose images are added to `textures`.
    pub fn of(scenery: &Scenery, textures: &mut SceneTextures) -> Geometry {
        let mut numbers = Vec::new();
        let mut meshes = Vec::new();
        let mut known: HashMap<Vec<u8>, usize> = HashMap::new();
        let parts = scenery.parts.iter().map(|part| {
            let has_uv = part.image.as_ref().is_some_and(|image| image.mapping == TextureMapping::Corners);
            let bytes = mesh_bytes(&part.mesh, has_uv);
            let mesh = *known.entry(bytes).or_insert_with_key(|bytes| {
                numbers.extend_from_slice(bytes);
                let (vertices, triangles) = (part.mesh.vertices.len(), part.mesh.triangles.len());
                meshes.push(if has_uv {
                    json!([vertices, triangles, 1])
                } else {
                    json!([vertices, triangles])
                });
                meshes.len() - 1
            });
            part_row(part, mesh, textures)
        });
        let parts = parts.collect();
        Geometry { parts, meshes: meshes.into(), numbers }
    }
}

/// Returns a part, with `gloss` and `image` if it has them.
fn part_row(part: &Part, mesh: usize, textures: &mut SceneTextures) -> Value {
    let (pattern, second) = match part.pattern {
        Pattern::Plain => ("plain", None),
        Pattern::Checker(rgb) => ("checker", Some(rgb)),
        Pattern::Wood => ("wood", None),
        Pattern::Fabric => ("fabric", None),
        Pattern::Print => ("print", None),
    };
    let mut row = json!({
        "mesh": mesh, "carrier": carrier_row(part.carrier), "pose": pose_row(&part.carrier_from_mesh),
        "rgb": part.rgb, "alpha": part.alpha, "pattern": pattern, "second_rgb": second,
        "casts_shadow": part.casts_shadow,
    });
    if part.gloss != Gloss::default() {
        row["gloss"] = gloss_row(&part.gloss);
    }
    if let Some(image) = &part.image {
        row["image"] = image_row(image, textures);
    }
    row
}

fn gloss_row(gloss: &Gloss) -> Value {
    json!({
        "emission": gloss.emission_factor, "specular": gloss.specular_factor,
        "shininess": gloss.shininess_factor, "roughness": gloss.roughness_factor,
        "metallic": gloss.metallic_factor,
    })
}

fn image_row(image: &SurfaceImage, textures: &mut SceneTextures) -> Value {
    let SurfaceImage { texture, gloss, relief, emitted, mapping } = image;
    let mapping = match mapping {
        TextureMapping::Corners => json!({ "kind": "corners" }),
        TextureMapping::Along { scale_1_m, centre_m } => {
            json!({ "kind": "along", "scale_1_m": scale_1_m, "centre_m": centre_m })
        }
        TextureMapping::Cube { scale_1_m, centre_m } => {
            json!({ "kind": "cube", "scale_1_m": scale_1_m.to_array(), "centre_m": centre_m.to_array() })
        }
    };
    let mut number = |texture| textures.number(texture);
    json!({
        "texture": number(texture), "gloss": gloss.as_ref().map(&mut number),
        "relief": relief.as_ref().map(&mut number), "emitted": emitted.as_ref().map(&mut number),
        "mapping": mapping,
    })
}

fn mesh_bytes(mesh: &TriangleMesh, has_uv: bool) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(24 * mesh.vertices.len() + 12 * mesh.triangles.len());
    for vertex in &mesh.vertices {
        bytes.extend(vertex.position_m.to_array().into_iter().flat_map(f32::to_le_bytes));
    }
    bytes.extend(mesh.triangles.iter().flatten().flat_map(|corner| corner.to_le_bytes()));
    for vertex in &mesh.vertices {
        bytes.extend(vertex.normal.to_array().map(|part| (part * 127.0).round() as i8 as u8));
        bytes.push(0);
    }
    for vertex in mesh.vertices.iter().filter(|_| has_uv) {
        bytes.extend(vertex.uv.into_iter().flat_map(f32::to_le_bytes));
    }
    bytes
}
