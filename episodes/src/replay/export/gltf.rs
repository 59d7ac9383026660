//! Binary glTF 2.0: the room and what moves in it as an animation, cameras, and the sun. Up is y.

use std::f32::consts::{FRAC_1_SQRT_2, PI};
use std::iter::repeat_n;

use serde_json::{Map, Value, json};
use tandem_sim::render::{PictureError, TriangleMesh};
use tandem_sim::{Pose, Rotation, Vector};

use super::moving::{MovingCamera, MovingScene, Shape, Track};
use super::surfaces::{Surface, SurfaceImages};

/// Types of numbers in glTF.
const GLTF_F32: u32 = 5126;
const GLTF_U32: u32 = 5125;
/// Size of the head of a binary file, and of the head of each of its two chunks.
const HEAD_BYTES: usize = 12;
const CHUNK_HEAD_BYTES: usize = 8;
/// Distance from a camera's eye at which its image begins.
const NEAR_M: f32 = 0.01;
const LIGHTS: &str = "KHR_lights_punctual";

/// Numbers and images of the file, with their places.
#[derive(Default)]
struct Binary {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Binary {
    /// Appends bytes, and returns the number of their view.
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    /// Appends rows of numbers with their bounds, and returns the number of their accessor.
    fn rows<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect();
        let bound = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..N).map(|column| rows.iter().map(|row| row[column]).fold(start, pick)).collect()
        };
        let (low, high) = (bound(f32::INFINITY, f32::min), bound(f32::NEG_INFINITY, f32::max));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let view = self.view(&bytes);
        self.accessor(json!({
            "bufferView": view, "componentType": GLTF_F32, "count": rows.len(), "type": kind, "min": low, "max": high,
        }))
    }

    fn corners(&mut self, triangles: &[[u32; 3]]) -> usize {
        let bytes: Vec<u8> =
            triangles.as_flattened().iter().flat_map(|corner| corner.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.accessor(json!({
            "bufferView": view, "componentType": GLTF_U32, "count": 3 * triangles.len(), "type": "SCALAR",
        }))
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

/// Returns the file; `None` if it would have more bytes than its format can count.
pub fn file(scene: &MovingScene) -> Result<Option<Vec<u8>>, PictureError> {
    let mut binary = Binary::default();
    let images = images(scene, &mut binary)?;
    let primitives: Vec<Value> = scene.meshes.iter().map(|mesh| primitive(mesh, &mut binary)).collect();
    let mut nodes = Nodes { list: vec![Value::Null], meshes: Vec::new(), animation: Animation::default() };
    let moments: Vec<[f32; 1]> =
        (0..scene.moments).map(|moment| [moment as f32 / scene.rate_hz as f32]).collect();
    let times = binary.rows(&moments);
    let mut top = Vec::new();
    for (frame, track) in scene.frames.iter().enumerate() {
        let shapes = scene.shapes.iter().filter(|shape| shape.frame == frame);
        let children: Vec<usize> = shapes.map(|shape| nodes.shape(shape, &primitives)).collect();
        if !children.is_empty() {
            top.push(nodes.moving(track, json!({ "children": children }), times, &mut binary));
        }
    }
    for (number, camera) in scene.cameras.iter().enumerate() {
        top.push(nodes.moving(&camera.track, json!({ "camera": number }), times, &mut binary));
    }
    for (number, light) in scene.lights.iter().enumerate() {
        let turn = Rotation::from_rotation_arc(Vector::NEG_Z, light.direction).to_array();
        top.push(nodes.add(json!({
            "name": format!("light_{number}"), "rotation": turn, "extensions": { LIGHTS: { "light": number } },
        })));
    }
    // Turns Tandem's z to the y that is up in glTF.
    nodes.list[0] =
        json!({ "name": "world", "rotation": [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2], "children": top });
    let lights: Vec<Value> = scene.lights.iter().map(|light| distant_light(light.rgb)).collect();
    let Nodes { list, meshes, animation } = nodes;
    let mut head = json!({
        "asset": { "version": "2.0", "generator": "Tandem" },
        "extensionsUsed": [LIGHTS],
        "extensions": { LIGHTS: { "lights": lights } },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": list,
        "meshes": meshes,
        "materials": scene.surfaces.iter().map(material).collect::<Vec<_>>(),
        "cameras": scene.cameras.iter().map(camera).collect::<Vec<_>>(),
    });
    let textures: Vec<Value> = (0..images.len()).map(|image| json!({ "source": image })).collect();
    let optional = [
        ("images", images),
        ("textures", textures),
        ("animations", animation.list()),
        ("accessors", std::mem::take(&mut binary.accessors)),
        ("bufferViews", std::mem::take(&mut binary.views)),
    ];
    for (name, list) in optional {
        // glTF has no empty lists.
        if !list.is_empty() {
            head[name] = list.into();
        }
    }
    head["buffers"] = json!([{ "byteLength": binary.bytes.len().next_multiple_of(4) }]);
    Ok(packed(&head.to_string(), binary.bytes))
}

/// Returns a binary file of its two chunks.
fn packed(head: &str, mut numbers: Vec<u8>) -> Option<Vec<u8>> {
    numbers.resize(numbers.len().next_multiple_of(4), 0);
    let head_bytes = head.len().next_multiple_of(4);
    let total = u32::try_from(HEAD_BYTES + 2 * CHUNK_HEAD_BYTES + head_bytes + numbers.len()).ok()?;
    let mut file = [&b"glTF"[..], &2_u32.to_le_bytes(), &total.to_le_bytes()].concat();
    file.extend([&(head_bytes as u32).to_le_bytes(), &b"JSON"[..]].concat());
    file.extend(head.bytes().chain(repeat_n(b' ', head_bytes - head.len())));
    file.extend([&(numbers.len() as u32).to_le_bytes(), &b"BIN\0"[..]].concat());
    file.extend(numbers);
    Some(file)
}

/// Nodes of the scene, their meshes, and the motion of the nodes.
struct Nodes {
    list: Vec<Value>,
    meshes: Vec<Value>,
    animation: Animation,
}

#[derive(Default)]
struct Animation {
    channels: Vec<Value>,
    samplers: Vec<Value>,
}

impl Animation {
    fn list(self) -> Vec<Value> {
        let Animation { channels, samplers } = self;
        if channels.is_empty() {
            return Vec::new();
        }
        vec![json!({ "name": "episode", "channels": channels, "samplers": samplers })]
    }
}

impl Nodes {
    fn add(&mut self, node: Value) -> usize {
        self.list.push(node);
        self.list.len() - 1
    }

    /// Adds a shape on the node of its frame.
    fn shape(&mut self, shape: &Shape, primitives: &[Value]) -> usize {
        let mut primitive = primitives[shape.mesh].clone();
        primitive["material"] = shape.surface.into();
        let mesh = json!({ "primitives": [primitive] });
        let known = self.meshes.iter().position(|known| *known == mesh);
        let number = known.unwrap_or_else(|| {
            self.meshes.push(mesh);
            self.meshes.len() - 1
        });
        self.add(placed(&shape.frame_from_mesh, json!({ "mesh": number })))
    }

    /// Adds the node of a frame or camera, and its motion.
    fn moving(&mut self, track: &Track, mut node: Value, times: usize, binary: &mut Binary) -> usize {
        node["name"] = track.name.as_str().into();
        let poses = &track.world_from_frame;
        let node = self.add(placed(poses.first().unwrap_or(&Pose::IDENTITY), node));
        if poses.len() < 2 {
            return node;
        }
        let places: Vec<[f32; 3]> = poses.iter().map(|pose| pose.translation.to_array()).collect();
        let turns: Vec<[f32; 4]> = poses.iter().map(|pose| pose.rotation.normalize().to_array()).collect();
        for (path, output) in [("translation", binary.rows(&places)), ("rotation", binary.rows(&turns))] {
            let sampler = self.animation.samplers.len();
            self.animation.samplers.push(json!({ "input": times, "output": output }));
            self.animation
                .channels
                .push(json!({ "sampler": sampler, "target": { "node": node, "path": path } }));
        }
        node
    }
}

/// Returns a node with its pose.
fn placed(pose: &Pose, mut node: Value) -> Value {
    node["translation"] = json!(pose.translation.to_array());
    node["rotation"] = json!(pose.rotation.normalize().to_array());
    node
}

fn primitive(mesh: &TriangleMesh, binary: &mut Binary) -> Value {
    let column = |of: fn(&tandem_sim::render::Vertex) -> Vector| -> Vec<[f32; 3]> {
        mesh.vertices.iter().map(|vertex| of(vertex).to_array()).collect()
    };
    let mut attributes = Map::new();
    attributes.insert("POSITION".into(), binary.rows(&column(|vertex| vertex.position_m)).into());
    let normals = column(|vertex| vertex.normal.normalize_or(Vector::Z));
    attributes.insert("NORMAL".into(), binary.rows(&normals).into());
    if mesh.vertices.iter().any(|vertex| vertex.uv != [0.0; 2]) {
        let uvs: Vec<[f32; 2]> = mesh.vertices.iter().map(|vertex| vertex.uv).collect();
        attributes.insert("TEXCOORD_0".into(), binary.rows(&uvs).into());
    }
    json!({ "attributes": attributes, "indices": binary.corners(&mesh.triangles) })
}

fn images(scene: &MovingScene, binary: &mut Binary) -> Result<Vec<Value>, PictureError> {
    let image = |image: &std::sync::Arc<crate::live::LiveTexture>| {
        let file = image.file()?;
        Ok(json!({ "bufferView": binary.view(&file.bytes), "mimeType": file.media_type }))
    };
    scene.images.iter().map(image).collect()
}

fn material(surface: &Surface) -> Value {
    let [red, green, blue] = surface.base_rgb;
    let mut shading = json!({
        "baseColorFactor": [red, green, blue, surface.alpha],
        "roughnessFactor": surface.roughness_factor,
        "metallicFactor": surface.metallic_factor,
    });
    // Images of Tandem's have two sides where their mesh has one.
    let mut material = json!({ "doubleSided": true });
    if surface.emitted_rgb != [0.0; 3] {
        material["emissiveFactor"] = json!(surface.emitted_rgb);
    }
    if surface.is_clear() {
        material["alphaMode"] = "BLEND".into();
    }
    if let Some(SurfaceImages { colour, has_alpha, gloss, relief, emitted }) = surface.images {
        shading["baseColorTexture"] = json!({ "index": colour });
        if has_alpha && !surface.is_clear() {
            material["alphaMode"] = "MASK".into();
        }
        if let Some(gloss) = gloss {
            shading["metallicRoughnessTexture"] = json!({ "index": gloss });
            material["occlusionTexture"] = json!({ "index": gloss });
        }
        if let Some(relief) = relief {
            material["normalTexture"] = json!({ "index": relief });
        }
        if let Some(emitted) = emitted {
            material["emissiveTexture"] = json!({ "index": emitted });
        }
    }
    material["pbrMetallicRoughness"] = shading;
    material
}

fn camera(camera: &MovingCamera) -> Value {
    json!({
        "name": camera.track.name, "type": "perspective",
        "perspective": {
            "yfov": camera.vertical_fov_rad, "aspectRatio": camera.aspect_ratio, "znear": NEAR_M,
        },
    })
}

/// Returns a distant light. A white surface that faces a light of pi lux reflects 1.
fn distant_light(rgb: Vector) -> Value {
    let brightest = rgb.max_element().max(f32::MIN_POSITIVE);
    json!({ "type": "directional", "color": (rgb / brightest).to_array(), "intensity": PI * brightest })
}
