//! Visible meshes of the geoms of a body, cached for all worlds of a process that contain an equal body.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, PoisonError};

use rapier3d::math::{Pose, Vector};
use xxhash_rust::xxh3::Xxh3;

use super::hidden;
use super::shared::SharedMesh;
use crate::mjcf::{Geom, Primitive, TextureMapping};
use crate::render::TriangleMesh;
use crate::render::shading::SOLID_ALPHA;

/// Maximum number of cached triangles, of about 200 bytes each. The meshes of the latest body are always
/// kept.
const MAX_KEPT_TRIANGLES: usize = 1_500_000;

static BODIES: LazyLock<Mutex<KeptBodies>> = LazyLock::new(Mutex::default);

/// Cache of meshes, by a hash of their geoms.
#[derive(Default)]
struct KeptBodies {
    of_geoms: HashMap<u128, KeptBody>,
    triangles: usize,
    /// Number of lookups.
    clock: u64,
}

struct KeptBody {
    meshes: Vec<Option<SharedMesh>>,
    triangles: usize,
    /// Value of the clock at the last lookup.
    asked: u64,
}

/// Returns the visible part of each of a body's geoms; `None` for geoms inside others.
pub fn meshes(geoms: &[&Geom]) -> Vec<Option<SharedMesh>> {
    if geoms.is_empty() {
        return Vec::new();
    }
    let key = key(geoms);
    // Every call leaves the cache consistent, so a poisoned lock is safe to use.
    let kept = || BODIES.lock().unwrap_or_else(PoisonError::into_inner);
    let found = kept().find(key);
    found.unwrap_or_else(|| {
        let meshes = made(geoms);
        kept().keep(key, meshes.clone());
        meshes
    })
}

fn made(geoms: &[&Geom]) -> Vec<Option<SharedMesh>> {
    let placed = |geom: &&Geom| {
        let mesh = TriangleMesh::of(&geom.primitive);
        (if uses_uvs(geom) { mesh } else { mesh.without_uvs() }, geom.body_from_geom)
    };
    let mut meshes: Vec<(TriangleMesh, Pose)> = geoms.iter().map(placed).collect();
    let is_clear: Vec<bool> = geoms.iter().map(|geom| is_clear(geom)).collect();
    hidden::take_out(&mut meshes, &is_clear);
    let shown = |(mesh, _): (TriangleMesh, Pose)| (!mesh.triangles.is_empty()).then(|| mesh.into());
    meshes.into_iter().map(shown).collect()
}

/// Returns true if an image is mapped by the texture coordinates of the mesh.
fn uses_uvs(geom: &Geom) -> bool {
    geom.image.as_ref().is_some_and(|image| image.mapping == TextureMapping::Corners)
}

/// Returns true if the geoms inside of a geom are visible.
fn is_clear(geom: &Geom) -> bool {
    let has_alpha = geom.image.as_ref().is_some_and(|image| image.texture.has_alpha);
    geom.rgba[3] < SOLID_ALPHA || has_alpha
}

impl KeptBodies {
    fn find(&mut self, key: u128) -> Option<Vec<Option<SharedMesh>>> {
        self.clock += 1;
        let body = self.of_geoms.get_mut(&key)?;
        body.asked = self.clock;
        Some(body.meshes.clone())
    }

    /// Caches the meshes of a body. Removes the least recently used ones if there are too many triangles.
    fn keep(&mut self, key: u128, meshes: Vec<Option<SharedMesh>>) {
        let triangles = meshes.iter().flatten().map(|mesh| mesh.triangles.len()).sum();
        let body = KeptBody { meshes, triangles, asked: self.clock };
        self.triangles += triangles;
        if let Some(before) = self.of_geoms.insert(key, body) {
            self.triangles -= before.triangles;
        }
        while self.triangles > MAX_KEPT_TRIANGLES {
            let others = self.of_geoms.iter().filter(|(other, _)| **other != key);
            let Some(oldest) = others.min_by_key(|(_, body)| body.asked).map(|(key, _)| *key) else { break };
            if let Some(forgotten) = self.of_geoms.remove(&oldest) {
                self.triangles -= forgotten.triangles;
            }
        }
    }
}

/// Returns a hash of the shapes and poses of geoms, and of whether they are clear and use texture
/// coordinates.
fn key(geoms: &[&Geom]) -> u128 {
    let mut content = Content(Xxh3::new());
    for geom in geoms {
        let Pose { translation, rotation, .. } = geom.body_from_geom;
        content.points(&[translation]);
        content.numbers(&rotation.to_array());
        content.shape(&geom.primitive);
        content.0.update(&[u8::from(uses_uvs(geom)), u8::from(is_clear(geom))]);
    }
    content.0.digest128()
}

struct Content(Xxh3);

impl Content {
    fn numbers(&mut self, values: &[f32]) {
        values.iter().for_each(|number| self.0.update(&number.to_bits().to_ne_bytes()));
    }

    fn points(&mut self, points_m: &[Vector]) {
        self.0.update(&points_m.len().to_ne_bytes());
        points_m.iter().for_each(|point| self.numbers(&point.to_array()));
    }

    fn shape(&mut self, shape: &Primitive) {
        match shape {
            Primitive::Sphere { radius_m } => self.kind(0, &[*radius_m]),
            Primitive::Capsule { radius_m, half_length_m } => self.kind(1, &[*radius_m, *half_length_m]),
            Primitive::Cylinder { radius_m, half_length_m } => self.kind(2, &[*radius_m, *half_length_m]),
            Primitive::Box { half_extents_m } => self.kind(3, &half_extents_m.to_array()),
            Primitive::Ellipsoid { radii_m } => self.kind(4, &radii_m.to_array()),
            Primitive::Plane { half_extents_m } => self.kind(5, half_extents_m),
            Primitive::Convex { vertices_m } => {
                self.kind(6, &[]);
                self.points(vertices_m);
            }
            Primitive::Mesh(mesh) => {
                self.kind(7, &[]);
                self.0.update(&mesh.content_hash().to_ne_bytes());
            }
        }
    }

    fn kind(&mut self, kind: u8, values: &[f32]) {
        self.0.update(&[kind]);
        self.numbers(values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mjcf::Document;

    fn body(geoms: &str) -> Vec<Geom> {
        let xml = format!("<mujoco><worldbody>{geoms}</worldbody></mujoco>");
        let document = Document::parse("body", &xml).expect("a body");
        document.trees().expect("a body")[0].links[0].geoms.clone()
    }

    fn made_once(one: &str, other: &str) -> bool {
        let meshes = |geoms: &str| {
            let geoms = body(geoms);
            meshes(&geoms.iter().collect::<Vec<_>>())
        };
        let (one, other) = (meshes(one), meshes(other));
        let vertices = |meshes: &[Option<SharedMesh>]| meshes[0].as_ref().map(|mesh| mesh.vertices.as_ptr());
        vertices(&one) == vertices(&other)
    }

    #[test]
    fn bodies_share_their_meshes_if_their_shapes_and_places_are_the_same() {
        let ball = r#"<geom size="0.111"/>"#;
        assert!(made_once(ball, r#"<geom size="0.111" rgba="1 0 0 1"/>"#));
        assert!(!made_once(ball, r#"<geom size="0.112"/>"#));
        assert!(!made_once(ball, r#"<geom size="0.111" pos="0 0 1"/>"#));
        assert!(
            !made_once(ball, r#"<geom size="0.111"/><geom size="0.1"/>"#),
            "what is beside it may hide it"
        );
    }

    #[test]
    fn what_nobody_has_asked_for_the_longest_is_forgotten() {
        let mut kept = KeptBodies::default();
        let of = |triangles: usize| {
            let mesh = TriangleMesh { vertices: Vec::new(), triangles: vec![[0; 3]; triangles] };
            vec![Some(mesh.into())]
        };
        let most = MAX_KEPT_TRIANGLES;
        kept.keep(1, of(most / 2));
        kept.keep(2, of(most / 2));
        assert!(kept.find(1).is_some());
        kept.keep(3, of(most / 4));
        assert_eq!([1, 2, 3].map(|key| kept.find(key).is_some()), [true, false, true]);
        kept.keep(4, of(2 * most));
        assert_eq!([1, 3, 4].map(|key| kept.find(key).is_some()), [false, false, true]);
        assert_eq!(kept.triangles, 2 * most);
    }
}
