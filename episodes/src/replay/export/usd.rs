//! USD as text: the room and what moves in it as time samples, cameras, and the sun. Up is z, lengths are in
//! metres. Images are PNG and JPEG files in a folder beside the file.

use std::f32::consts::PI;
use std::fmt::Write;
use std::path::Path;

use tandem_sim::render::TriangleMesh;
use tandem_sim::{Pose, Rotation, Vector};

use super::ExportError;
use super::moving::{MovingCamera, MovingScene, SceneLight, Shape, Track};
use super::surfaces::{Surface, SurfaceImages};
use crate::output::{OutputError, write_whole};

/// Height of a camera's sensor. USD's cameras state their angle by it and the focal length, in tenths of a
/// scene unit.
const APERTURE: f32 = 0.24;

/// Writes the file, and its images into the folder `STEM_textures`.
pub fn write(scene: &MovingScene, path: &Path) -> Result<(), ExportError> {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or("scene");
    let folder = format!("{stem}_textures");
    let mut names = Vec::new();
    if !scene.images.is_empty() {
        let beside = path.with_file_name(&folder);
        std::fs::create_dir_all(&beside)
            .map_err(|source| OutputError::Io { path: beside.clone(), source })?;
        for image in &scene.images {
            let file = image.file()?;
            let name = format!("{}.{}", image.hash(), file.media_type.trim_start_matches("image/"));
            write_whole(&beside.join(&name), &file.bytes)?;
            names.push(format!("./{folder}/{name}"));
        }
    }
    write_whole(path, text(scene, &names).as_bytes())?;
    Ok(())
}

/// Returns the text of the file, with the images at the paths `images`.
fn text(scene: &MovingScene, images: &[String]) -> String {
    let mut usd = Layer::default();
    usd.line("#usda 1.0");
    usd.line("(");
    usd.line("    defaultPrim = \"World\"");
    usd.line("    metersPerUnit = 1");
    usd.line("    upAxis = \"Z\"");
    usd.line(&format!("    timeCodesPerSecond = {}", scene.rate_hz));
    usd.line("    startTimeCode = 0");
    usd.line(&format!("    endTimeCode = {}", scene.moments.saturating_sub(1)));
    usd.line(")");
    // Prims of a class are referred to and not drawn themselves.
    usd.block("class \"Meshes\"", |usd| {
        for (number, mesh) in scene.meshes.iter().enumerate() {
            usd.block(&format!("def Mesh \"mesh_{number}\""), |usd| usd.mesh(mesh));
        }
    });
    usd.block("def Xform \"World\"", |usd| {
        usd.block("def Scope \"Materials\"", |usd| {
            for (number, surface) in scene.surfaces.iter().enumerate() {
                usd.material(number, surface, images);
            }
        });
        let names = distinct_names(scene.frames.iter().map(|track| track.name.as_str()));
        for (frame, (track, name)) in scene.frames.iter().zip(names).enumerate() {
            let shapes: Vec<&Shape> = scene.shapes.iter().filter(|shape| shape.frame == frame).collect();
            if shapes.is_empty() {
                continue;
            }
            usd.block(&format!("def Xform \"{name}\""), |usd| {
                usd.track(track);
                for (number, shape) in shapes.into_iter().enumerate() {
                    usd.shape(number, shape);
                }
            });
        }
        for camera in &scene.cameras {
            usd.block(&format!("def Camera \"camera_{}\"", identifier(&camera.track.name)), |usd| {
                usd.camera(camera);
            });
        }
        for (number, light) in scene.lights.iter().enumerate() {
            usd.block(&format!("def DistantLight \"light_{number}\""), |usd| usd.light(light));
        }
    });
    usd.text
}

/// Text with indentation.
#[derive(Default)]
struct Layer {
    text: String,
    depth: usize,
}

impl Layer {
    fn line(&mut self, line: &str) {
        for _ in 0..self.depth {
            self.text.push_str("    ");
        }
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn block(&mut self, head: &str, content: impl FnOnce(&mut Layer)) {
        self.line(head);
        self.braces(content);
    }

    fn braces(&mut self, content: impl FnOnce(&mut Layer)) {
        self.line("{");
        self.depth += 1;
        content(self);
        self.depth -= 1;
        self.line("}");
    }

    fn mesh(&mut self, mesh: &TriangleMesh) {
        let vectors = |of: fn(&tandem_sim::render::Vertex) -> Vector| {
            list(mesh.vertices.iter().map(|vertex| tuple(&of(vertex).to_array())))
        };
        self.line("uniform token subdivisionScheme = \"none\"");
        self.line("uniform bool doubleSided = 1");
        self.line(&format!("int[] faceVertexCounts = {}", list(mesh.triangles.iter().map(|_| "3".into()))));
        let corners = mesh.triangles.as_flattened().iter().map(u32::to_string);
        self.line(&format!("int[] faceVertexIndices = {}", list(corners)));
        self.line(&format!("point3f[] points = {}", vectors(|vertex| vertex.position_m)));
        self.line(&format!("normal3f[] normals = {} (", vectors(|vertex| vertex.normal)));
        self.line("    interpolation = \"vertex\"");
        self.line(")");
        if mesh.vertices.iter().any(|vertex| vertex.uv != [0.0; 2]) {
            // The second coordinate is upwards in USD.
            let uvs = mesh.vertices.iter().map(|vertex| tuple(&[vertex.uv[0], 1.0 - vertex.uv[1]]));
            self.line(&format!("texCoord2f[] primvars:st = {} (", list(uvs)));
            self.line("    interpolation = \"vertex\"");
            self.line(")");
        }
    }

    fn material(&mut self, number: usize, surface: &Surface, images: &[String]) {
        let path = format!("/World/Materials/material_{number}");
        self.block(&format!("def Material \"material_{number}\""), |usd| {
            usd.line(&format!("token outputs:surface.connect = <{path}/surface.outputs:surface>"));
            usd.block("def Shader \"surface\"", |usd| usd.preview_surface(surface, &path));
            let Some(SurfaceImages { colour, gloss, relief, emitted, .. }) = surface.images else { return };
            usd.block("def Shader \"coordinates\"", |usd| {
                usd.line("uniform token info:id = \"UsdPrimvarReader_float2\"");
                usd.line("string inputs:varname = \"st\"");
                usd.line("float2 outputs:result");
            });
            let [red, green, blue] = surface.base_rgb;
            let tint = format!("float4 inputs:scale = ({red}, {green}, {blue}, 1)");
            usd.texture("colour", &images[colour], "sRGB", &path, &[&tint]);
            if let Some(gloss) = gloss {
                let [rough, metal] = [surface.roughness_factor, surface.metallic_factor];
                let scale = format!("float4 inputs:scale = (1, {rough}, {metal}, 1)");
                usd.texture("gloss", &images[gloss], "raw", &path, &[&scale]);
            }
            if let Some(relief) = relief {
                let normals = ["float4 inputs:scale = (2, 2, 2, 1)", "float4 inputs:bias = (-1, -1, -1, 0)"];
                usd.texture("relief", &images[relief], "raw", &path, &normals);
            }
            if let Some(emitted) = emitted {
                usd.texture("emitted", &images[emitted], "sRGB", &path, &[]);
            }
        });
    }

    fn preview_surface(&mut self, surface: &Surface, path: &str) {
        let connected = |kind: &str, input: &str, image: &str, output: &str| {
            format!("{kind} inputs:{input}.connect = <{path}/{image}.outputs:{output}>")
        };
        let plain = |kind: &str, input: &str, value: String| format!("{kind} inputs:{input} = {value}");
        let images = surface.images;
        let has = |pick: fn(SurfaceImages) -> Option<usize>| images.and_then(pick).is_some();
        self.line("uniform token info:id = \"UsdPreviewSurface\"");
        self.line(&match images {
            Some(_) => connected("color3f", "diffuseColor", "colour", "rgb"),
            None => plain("color3f", "diffuseColor", tuple(&surface.base_rgb)),
        });
        match has(|images| images.gloss) {
            true => {
                for (input, output) in [("occlusion", "r"), ("roughness", "g"), ("metallic", "b")] {
                    self.line(&connected("float", input, "gloss", output));
                }
            }
            false => {
                self.line(&plain("float", "roughness", surface.roughness_factor.to_string()));
                self.line(&plain("float", "metallic", surface.metallic_factor.to_string()));
            }
        }
        self.line(&match has(|images| images.emitted) {
            true => connected("color3f", "emissiveColor", "emitted", "rgb"),
            false => plain("color3f", "emissiveColor", tuple(&surface.emitted_rgb)),
        });
        if has(|images| images.relief) {
            self.line(&connected("normal3f", "normal", "relief", "rgb"));
        }
        match images.is_some_and(|images| images.has_alpha) && !surface.is_clear() {
            true => {
                self.line(&connected("float", "opacity", "colour", "a"));
                self.line(&plain("float", "opacityThreshold", "0.5".into()));
            }
            false => self.line(&plain("float", "opacity", surface.alpha.to_string())),
        }
        self.line("token outputs:surface");
    }

    fn texture(&mut self, name: &str, file: &str, space: &str, path: &str, further: &[&str]) {
        self.block(&format!("def Shader \"{name}\""), |usd| {
            usd.line("uniform token info:id = \"UsdUVTexture\"");
            usd.line(&format!("asset inputs:file = @{file}@"));
            usd.line(&format!("token inputs:sourceColorSpace = \"{space}\""));
            usd.line("token inputs:wrapS = \"repeat\"");
            usd.line("token inputs:wrapT = \"repeat\"");
            usd.line(&format!("float2 inputs:st.connect = <{path}/coordinates.outputs:result>"));
            for line in further {
                usd.line(line);
            }
            for output in ["float3 outputs:rgb", "float outputs:r", "float outputs:g", "float outputs:b"] {
                usd.line(output);
            }
            usd.line("float outputs:a");
        });
    }

    fn shape(&mut self, number: usize, shape: &Shape) {
        self.line(&format!("def Mesh \"part_{number}\" ("));
        self.line("    prepend apiSchemas = [\"MaterialBindingAPI\"]");
        self.line(&format!("    prepend references = </Meshes/mesh_{}>", shape.mesh));
        self.line(")");
        self.braces(|usd| {
            usd.line(&format!("rel material:binding = </World/Materials/material_{}>", shape.surface));
            usd.poses(&[shape.frame_from_mesh]);
        });
    }

    fn camera(&mut self, camera: &MovingCamera) {
        let focal = 0.5 * APERTURE / (0.5 * camera.vertical_fov_rad).tan();
        self.line(&format!("float focalLength = {focal}"));
        self.line(&format!("float verticalAperture = {APERTURE}"));
        self.line(&format!("float horizontalAperture = {}", APERTURE * camera.aspect_ratio));
        self.line("float2 clippingRange = (0.01, 1000)");
        self.track(&camera.track);
    }

    fn light(&mut self, light: &SceneLight) {
        self.line(&format!("color3f inputs:color = {}", tuple(&light.rgb.to_array())));
        // With this intensity a white surface that faces the light reflects its colour.
        self.line(&format!("float inputs:intensity = {PI}"));
        self.line("bool inputs:normalize = 1");
        let turn = Rotation::from_rotation_arc(Vector::NEG_Z, light.direction);
        self.poses(&[Pose::from_rotation(turn)]);
    }

    fn track(&mut self, track: &Track) {
        self.poses(&track.world_from_frame);
    }

    /// Writes a pose, or one for each time.
    fn poses(&mut self, poses: &[Pose]) {
        let places: Vec<String> = poses.iter().map(|pose| tuple(&pose.translation.to_array())).collect();
        let turn = |pose: &Pose| {
            let [x, y, z, w] = pose.rotation.normalize().to_array();
            tuple(&[w, x, y, z])
        };
        let turns: Vec<String> = poses.iter().map(turn).collect();
        for (kind, operation, values) in [("double3", "translate", places), ("quatf", "orient", turns)] {
            match &values[..] {
                [value] => self.line(&format!("{kind} xformOp:{operation} = {value}")),
                _ => {
                    self.line(&format!("{kind} xformOp:{operation}.timeSamples = {{"));
                    for (moment, value) in values.iter().enumerate() {
                        self.line(&format!("    {moment}: {value},"));
                    }
                    self.line("}");
                }
            }
        }
        self.line("uniform token[] xformOpOrder = [\"xformOp:translate\", \"xformOp:orient\"]");
    }
}

fn tuple(values: &[f32]) -> String {
    let mut text = String::from("(");
    for (index, value) in values.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(text, "{}{value}", if index > 0 { ", " } else { "" });
    }
    text + ")"
}

fn list(values: impl Iterator<Item = String>) -> String {
    format!("[{}]", values.collect::<Vec<_>>().join(", "))
}

/// Returns a name that USD accepts.
fn identifier(name: &str) -> String {
    let plain = |character: char| if character.is_ascii_alphanumeric() { character } else { '_' };
    let name: String = name.chars().map(plain).collect();
    if name.starts_with(|first: char| first.is_ascii_digit()) { format!("_{name}") } else { name }
}

/// Returns names that USD accepts and that differ, with a number where two would be equal.
fn distinct_names<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut known: Vec<String> = Vec::new();
    for name in names {
        let name = identifier(name);
        let taken = known.iter().filter(|known| **known == name).count();
        let candidate = if taken == 0 { name } else { format!("{name}_{}", known.len()) };
        known.push(candidate);
    }
    known
}
