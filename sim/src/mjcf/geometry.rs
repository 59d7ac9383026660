//! Geoms: primitive shapes with pose, material and friction, as Rapier colliders and for drawing.

use std::sync::Arc;

use mjcf_rs::body::GeomType;
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::prelude::SharedShape;

use super::assets::surface::MappedShape;
use super::{Document, Gloss, Mesh, SurfaceImage, SurfacePattern, pose, vector};
use crate::SimError;
use crate::dynamics::{Directions, Friction, Mask};

/// Shape in its own frame; axial shapes are along z, as in MJCF.
#[derive(Clone, Debug, PartialEq)]
pub enum Primitive {
    Sphere {
        radius_m: f32,
    },
    Capsule {
        radius_m: f32,
        half_length_m: f32,
    },
    Cylinder {
        radius_m: f32,
        half_length_m: f32,
    },
    Box {
        half_extents_m: Vector,
    },
    Ellipsoid {
        radii_m: Vector,
    },
    Plane {
        half_extents_m: [f32; 2],
    },
    /// Hull of a set of points.
    Convex {
        vertices_m: Vec<Vector>,
    },
    /// Drawn as the mesh itself. Collides as its hull, as in MuJoCo.
    Mesh(Arc<Mesh>),
}

/// One geom in its body's frame.
#[derive(Clone, Debug)]
pub struct Geom {
    pub name: Option<String>,
    pub primitive: Primitive,
    pub body_from_geom: Pose,
    /// Colour and opacity.
    pub rgba: [f32; 4],
    pub gloss: Gloss,
    pub material: Option<String>,
    /// Image of the material's texture, if it has one. `rgba` is then the image's mean colour.
    pub image: Option<SurfaceImage>,
    /// The two colours of the material's builtin texture if its pattern is tiles.
    pub checker_rgb: Option<[[f32; 3]; 2]>,
    pub friction: Friction,
    pub density_kg_m3: f32,
    pub mass_kg: Option<f32>,
    /// True if its mask or a pair lets it touch another geom.
    pub collides: bool,
    pub touches: Mask,
    pub drawn: bool,
    pub pattern: Option<SurfacePattern>,
}

const DEFAULT_DENSITY_KG_M3: f64 = 1000.0;
const DEFAULT_RGBA: [f64; 4] = [0.5, 0.5, 0.5, 1.0];
/// Dimensions of the slab that represents a plane in collisions: its thickness, which no object passes, and
/// its extent around nearby shapes. Planes of any drawn size are endless, as in MuJoCo. Half-spaces have no
/// centre of mass and no bounds.
const PLANE_THICKNESS_M: f32 = 2.0;
const PLANE_REACH_M: f32 = 50.0;

impl Primitive {
    fn mapped(&self) -> MappedShape {
        let around = |points_m: &[Vector], has_uv: bool| {
            let low_m = points_m.iter().copied().fold(Vector::INFINITY, Vector::min);
            let high_m = points_m.iter().copied().fold(Vector::NEG_INFINITY, Vector::max);
            let (half_m, centre_m) = ((high_m - low_m) * 0.5, (high_m + low_m) * 0.5);
            MappedShape { half_m, centre_m, is_mesh: true, has_uv }
        };
        let half_m = match self {
            Primitive::Sphere { radius_m } => Vector::splat(*radius_m),
            Primitive::Capsule { radius_m, half_length_m }
            | Primitive::Cylinder { radius_m, half_length_m } => {
                Vector::new(*radius_m, *radius_m, *half_length_m)
            }
            Primitive::Box { half_extents_m } => *half_extents_m,
            Primitive::Ellipsoid { radii_m } => *radii_m,
            Primitive::Plane { half_extents_m: [x, y] } => Vector::new(*x, *y, 1.0),
            Primitive::Convex { vertices_m } => return around(vertices_m, false),
            Primitive::Mesh(mesh) => return around(&mesh.vertices_m, !mesh.corner_uv.is_empty()),
        };
        MappedShape { half_m, centre_m: Vector::ZERO, is_mesh: false, has_uv: false }
    }
}

impl Geom {
    /// Reads geom `index` of a body.
    pub(super) fn read(document: &Document, body: usize, index: usize) -> Result<Geom, SimError> {
        let geom = &document.model.bodies[body].body.geoms[index];
        let refuse = |what: &str| document.source.refuse_at(document.checked.bodies[body].geoms[index], what);
        let (body_from_geom, half_length_m) = match geom.fromto {
            // The parser applies the frames around a geom to its pose, but not to its ends.
            Some(ends) => {
                let (frame_from_geom, half_length_m) = between(ends);
                (pose(&geom.pose) * frame_from_geom, half_length_m)
            }
            None => (pose(&geom.pose), vector(geom.size).y),
        };
        let material = geom.material.as_ref().and_then(|name| document.model.assets.material(name));
        let pattern = geom.material.as_ref().and_then(|name| document.looks.patterns.get(name).copied());
        let texture = material.and_then(|material| document.model.assets.texture(material.texture.as_ref()?));
        let is_tiled = pattern == Some(SurfacePattern::Tiles);
        let rgba = rgba(document, geom, material);
        let touches = match document.settings.touches {
            true => Mask { kinds: geom.contype, touched: geom.conaffinity },
            false => Mask { kinds: 0, touched: 0 },
        };
        let primitive = primitive(document, geom, half_length_m).map_err(|what| refuse(&what))?;
        Ok(Geom {
            name: geom.name.clone(),
            image: material
                .filter(|_| !is_tiled)
                .and_then(|material| SurfaceImage::of(document, material, || primitive.mapped())),
            primitive,
            body_from_geom,
            rgba,
            gloss: document.glosses.find(geom.material.as_deref()),
            material: geom.material.clone(),
            checker_rgb: texture.filter(|_| is_tiled).map(builtin_rgb),
            friction: friction(geom).map_err(|what| refuse(&what))?,
            density_kg_m3: geom.density.unwrap_or(DEFAULT_DENSITY_KG_M3) as f32,
            mass_kg: geom.mass.map(|m| m as f32),
            collides: touches.kinds != 0 || touches.touched != 0 || is_paired(document, geom),
            touches,
            drawn: document.looks.is_drawn(geom.group) && rgba[3] > 0.0,
            pattern,
        })
    }

    /// Returns the collision shape and its pose in the body's frame; `None` for a degenerate mesh.
    pub(crate) fn collider(&self) -> Option<(Pose, SharedShape)> {
        let mut body_from_shape = self.body_from_geom;
        // Rapier's cylinders and capsules are along y, MJCF's along z.
        let y_to_z = Pose::from_rotation(Rotation::from_rotation_x(std::f32::consts::FRAC_PI_2));
        let shape = match &self.primitive {
            Primitive::Sphere { radius_m } => SharedShape::ball(*radius_m),
            Primitive::Capsule { radius_m, half_length_m } => {
                SharedShape::capsule_z(*half_length_m, *radius_m)
            }
            Primitive::Cylinder { radius_m, half_length_m } => {
                body_from_shape *= y_to_z;
                SharedShape::cylinder(*half_length_m, *radius_m)
            }
            Primitive::Box { half_extents_m: h } => SharedShape::cuboid(h.x, h.y, h.z),
            Primitive::Ellipsoid { radii_m } => SharedShape::convex_hull(&ellipsoid_points(*radii_m))?,
            Primitive::Plane { .. } => {
                body_from_shape *= Pose::from_translation(Vector::new(0.0, 0.0, -PLANE_THICKNESS_M / 2.0));
                SharedShape::cuboid(PLANE_REACH_M, PLANE_REACH_M, PLANE_THICKNESS_M / 2.0)
            }
            Primitive::Convex { vertices_m } => SharedShape::convex_hull(vertices_m)?,
            Primitive::Mesh(mesh) => mesh.hull()?,
        };
        Some((body_from_shape, shape))
    }
}

fn is_paired(document: &Document, geom: &mjcf_rs::body::Geom) -> bool {
    geom.name.as_ref().is_some_and(|name| document.pairs.iter().any(|pair| pair.has(name)))
}

/// Returns the shape of a geom; `half_length_m` is half the distance between the two ends, if the geom has
/// ends.
fn primitive(
    document: &Document,
    geom: &mjcf_rs::body::Geom,
    half_length_m: f32,
) -> Result<Primitive, String> {
    let size = vector(geom.size);
    let radius_m = size.x;
    let between_ends = geom.fromto.is_some();
    let (primitive, extents_m) = match geom.type_ {
        GeomType::Sphere => (Primitive::Sphere { radius_m }, vec![radius_m]),
        GeomType::Capsule => (Primitive::Capsule { radius_m, half_length_m }, vec![radius_m, half_length_m]),
        GeomType::Cylinder => {
            (Primitive::Cylinder { radius_m, half_length_m }, vec![radius_m, half_length_m])
        }
        GeomType::Box | GeomType::Ellipsoid => {
            let half_m = if between_ends { Vector::new(radius_m, radius_m, half_length_m) } else { size };
            let primitive = match geom.type_ {
                GeomType::Box => Primitive::Box { half_extents_m: half_m },
                _ => Primitive::Ellipsoid { radii_m: half_m },
            };
            (primitive, half_m.to_array().to_vec())
        }
        GeomType::Plane => (Primitive::Plane { half_extents_m: [size.x, size.y] }, Vec::new()),
        GeomType::Mesh => (mesh(document, geom)?, Vec::new()),
        GeomType::Hfield | GeomType::Sdf => {
            let have = "sphere, capsule, cylinder, box, ellipsoid, plane or mesh";
            return Err(format!("it is of type {:?}; use {have}", geom.type_));
        }
    };
    if extents_m.iter().any(|extent_m| *extent_m <= 0.0) {
        return Err("it has an extent of 0; state a size for every direction".into());
    }
    let on_ends = !matches!(geom.type_, GeomType::Sphere | GeomType::Plane | GeomType::Mesh);
    if between_ends && !on_ends {
        return Err(
            "fromto is for capsules, cylinders, boxes and ellipsoids; state pos and a rotation".into()
        );
    }
    if geom.mesh.is_some() && geom.type_ != GeomType::Mesh {
        return Err("shapes are not fitted to meshes; use type=\"mesh\", or state the size".into());
    }
    Ok(primitive)
}

/// Returns the geom's own colour, or its material's. A flat texture or an image of the material tints it.
fn rgba(
    document: &Document,
    geom: &mjcf_rs::body::Geom,
    material: Option<&mjcf_rs::assets::Material>,
) -> [f32; 4] {
    let texture = material.and_then(|material| Some(document.colour_of(material)?.mean_rgb));
    let plain = if texture.is_some() { [1.0; 4] } else { DEFAULT_RGBA };
    let [r, g, b, a] =
        geom.rgba.or(material.and_then(|material| material.rgba)).unwrap_or(plain).map(|c| c as f32);
    let [x, y, z] = texture.unwrap_or([1.0; 3]);
    [r * x, g * y, b * z, a]
}

fn friction(geom: &mjcf_rs::body::Geom) -> Result<Friction, String> {
    let directions = Directions::from_condim(geom.condim)
        .ok_or_else(|| format!("condim=\"{}\"; use 1, 3, 4 or 6", geom.condim))?;
    let [slide, spin_m, roll_m] = geom.friction;
    Ok(Friction { directions, slide, spin_m, roll_m, priority: geom.priority, left: 1.0 })
}

/// Returns the two colours of a builtin texture, or MuJoCo's defaults if the file gives none.
fn builtin_rgb(texture: &mjcf_rs::assets::Texture) -> [[f32; 3]; 2] {
    let rgb = [texture.rgb1.unwrap_or([0.8; 3]), texture.rgb2.unwrap_or([0.5; 3])];
    rgb.map(|rgb| rgb.map(|c| c as f32))
}

/// Returns the pose with z from the first to the second end point, centred between them, and half the
/// distance.
pub(super) fn between(ends_m: [f64; 6]) -> (Pose, f32) {
    let a = vector([ends_m[0], ends_m[1], ends_m[2]]);
    let b = vector([ends_m[3], ends_m[4], ends_m[5]]);
    let half = (b - a) * 0.5;
    let rotation = Rotation::from_rotation_arc(Vector::Z, half.normalize_or(Vector::Z));
    (Pose::from_parts(a + half, rotation), half.length())
}

fn mesh(document: &Document, geom: &mjcf_rs::body::Geom) -> Result<Primitive, String> {
    let name = geom.mesh.as_deref().unwrap_or_default();
    if let Some(mesh) = document.meshes.get(name) {
        return Ok(Primitive::Mesh(mesh.clone()));
    }
    let asset = document.model.assets.mesh(name);
    let Some(vertices) = asset.and_then(|asset| asset.inline_vertices.as_ref()) else {
        return Err(format!("mesh `{name}` is no asset with a file or vertices"));
    };
    Ok(Primitive::Convex {
        vertices_m: vertices.chunks_exact(3).map(|v| vector([v[0], v[1], v[2]])).collect(),
    })
}

/// Returns the scaled points of a Fibonacci sphere, whose hull is the collision shape of an ellipsoid.
fn ellipsoid_points(radii_m: Vector) -> Vec<Vector> {
    const POINTS: usize = 96;
    const GOLDEN_ANGLE_RAD: f32 = 2.399_963_2;
    (0..POINTS)
        .map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / POINTS as f32;
            let (sin, cos) = (GOLDEN_ANGLE_RAD * i as f32).sin_cos();
            let ring = (1.0 - z * z).sqrt();
            Vector::new(ring * cos, ring * sin, z) * radii_m
        })
        .collect()
}
