//! Triangles as shading wants them in one state of the world.

use rapier3d::math::{Matrix, Vector};

use crate::render::prepared::{Face, Prepared};
use crate::render::{Carrier, Pattern, Placed};

/// The triangles that have been seen since the world last moved: most never are, and those that are in many pixels.
#[derive(Default)]
pub(super) struct Facets {
    /// Rotation and translation from each part's mesh to the world. Matrices, for they turn a vector fastest.
    world_from_mesh: Vec<(Matrix, Vector)>,
    /// Of each triangle.
    facets: Vec<Option<Facet>>,
}

/// A triangle in the world.
#[derive(Clone, Copy)]
pub(super) struct Facet {
    /// The normal at a point p of the triangle is `normal + bend * p`.
    normal: Vector,
    bend: Option<Matrix>,
    part: u32,
    linear_rgb: [Vector; 2],
    pattern: Pattern,
    /// Whether things stand on it, which darken it.
    pub carries: bool,
}

impl Facets {
    /// Forgets what was seen before the world was `placed` like this.
    pub(super) fn reset(&mut self, prepared: &Prepared, placed: &Placed) {
        let poses = placed.world_from_mesh.iter();
        self.world_from_mesh.clear();
        self.world_from_mesh.extend(poses.map(|pose| (Matrix::from_quat(pose.rotation), pose.translation)));
        self.facets.clear();
        self.facets.resize(prepared.faces.len(), None);
    }

    #[inline(always)]
    pub(super) fn get(&mut self, prepared: &Prepared, triangle: u32) -> &Facet {
        let world_from_mesh = &self.world_from_mesh;
        self.facets[triangle as usize]
            .get_or_insert_with(|| Facet::new(prepared, world_from_mesh, &prepared.faces[triangle as usize]))
    }
}

impl Facets {
    /// Linear colour of a triangle's surface at a point of the world.
    #[inline(always)]
    pub(super) fn albedo(&self, prepared: &Prepared, facet: &Facet, point_m: Vector) -> Vector {
        let [first, second] = facet.linear_rgb;
        if facet.pattern == Pattern::Plain {
            return first;
        }
        let share = facet.pattern.share(point_m, || {
            let (rotation, translation_m) = self.world_from_mesh[facet.part as usize];
            let in_mesh_m = rotation.transpose() * (point_m - translation_m);
            let grain = prepared.grain[facet.part as usize];
            Vector::new(in_mesh_m[grain], in_mesh_m[(grain + 1) % 3], in_mesh_m[(grain + 2) % 3])
        });
        first + (second - first) * share
    }
}

impl Facet {
    /// The normal at a point p, of a mesh whose frame is the world: n + B (p - corner).
    fn new(prepared: &Prepared, world_from_mesh: &[(Matrix, Vector)], face: &Face) -> Facet {
        let part = face.part as usize;
        let (rotation, translation_m) = world_from_mesh[part];
        let bend = face.bend_1_m.map(|bend_1_m| rotation * bend_1_m * rotation.transpose());
        let corner_m = rotation * face.corner_m + translation_m;
        let at_origin = bend.map_or(Vector::ZERO, |bend| bend * corner_m);
        Facet {
            normal: rotation * face.normal - at_origin,
            bend,
            part: face.part,
            linear_rgb: prepared.linear_rgb[part],
            pattern: prepared.scenery.parts[part].pattern,
            carries: prepared.scenery.parts[part].carrier == Carrier::Room,
        }
    }

    /// Of any length.
    #[inline(always)]
    pub(super) fn normal(&self, point_m: Vector) -> Vector {
        match self.bend {
            None => self.normal,
            Some(bend) => self.normal + bend * point_m,
        }
    }
}
