//! Triangle meshes of primitive shapes, with normals.

use std::f32::consts::{PI, TAU};

use rapier3d::math::Vector;

use super::smooth::smooth_normals;
use crate::mjcf::{Mesh, Primitive};

/// A corner of a triangle, in the mesh's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    pub position_m: Vector,
    pub normal: Vector,
    /// Texture coordinates: to the right and down from an image's top left corner; 0 if the mesh has none.
    pub uv: [f32; 2],
}

impl Vertex {
    fn new(position_m: Vector, normal: Vector) -> Vertex {
        Vertex { position_m, normal, uv: [0.0; 2] }
    }
}

/// Triangles, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<[u32; 3]>,
}

/// Returns the number of latitude bands for a shape of this radius. It is even, and half the number of
/// corners around the shape. Edges are up to 1.1 mm inside thin shapes, and a thirtieth of the radius inside
/// larger ones.
fn rings(radius_m: f32) -> u32 {
    if radius_m < 0.015 { 4 } else { 6 }
}

/// Half the drawn side of an unbounded plane.
const PLANE_M: f32 = 20.0;

impl TriangleMesh {
    /// Returns the surface of a shape; for points, their convex hull.
    pub fn of(primitive: &Primitive) -> TriangleMesh {
        match primitive {
            Primitive::Sphere { radius_m } => TriangleMesh::sphere(*radius_m),
            Primitive::Capsule { radius_m, half_length_m } => {
                TriangleMesh::capsule(*radius_m, *half_length_m)
            }
            Primitive::Cylinder { radius_m, half_length_m } => {
                TriangleMesh::cylinder(*radius_m, *half_length_m)
            }
            Primitive::Box { half_extents_m } => TriangleMesh::cuboid(*half_extents_m),
            Primitive::Ellipsoid { radii_m } => TriangleMesh::ellipsoid(*radii_m),
            Primitive::Plane { half_extents_m } => TriangleMesh::plane(*half_extents_m),
            Primitive::Convex { vertices_m } => {
                let (points_m, triangles) = rapier3d::parry::transformation::convex_hull(vertices_m);
                TriangleMesh::faceted(&points_m, &triangles)
            }
            Primitive::Mesh(mesh) => TriangleMesh::of_file(mesh),
        }
    }

    pub fn sphere(radius_m: f32) -> TriangleMesh {
        TriangleMesh::capsule(radius_m, 0.0)
    }

    /// Returns a capsule along z, which is a sphere if its length is 0.
    pub fn capsule(radius_m: f32, half_length_m: f32) -> TriangleMesh {
        TriangleMesh::round(rings(radius_m), radius_m, half_length_m)
    }

    pub fn ellipsoid(radii_m: Vector) -> TriangleMesh {
        let mut mesh = TriangleMesh::round(rings(radii_m.max_element()), 1.0, 0.0);
        for vertex in &mut mesh.vertices {
            vertex.position_m *= radii_m;
            vertex.normal = (vertex.normal / radii_m).normalize();
        }
        mesh
    }

    /// Returns a cylinder along z.
    pub fn cylinder(radius_m: f32, half_length_m: f32) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        let segments = 2 * rings(radius_m);
        let rim = |z| {
            (0..=segments).map(move |i| {
                let (sin, cos) = (TAU * i as f32 / segments as f32).sin_cos();
                (Vector::new(radius_m * cos, radius_m * sin, z), Vector::new(cos, sin, 0.0))
            })
        };
        for z in [half_length_m, -half_length_m] {
            mesh.vertices.extend(rim(z).map(|(position_m, normal)| Vertex::new(position_m, normal)));
        }
        mesh.join(0, segments + 1, segments);
        for z in [half_length_m, -half_length_m] {
            let normal = Vector::Z * z.signum();
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(rim(z).map(|(position_m, _)| Vertex::new(position_m, normal)));
            for i in 1..segments - 1 {
                let fan = if z > 0.0 { [0, i, i + 1] } else { [0, i + 1, i] };
                mesh.triangles.push(fan.map(|corner| first + corner));
            }
        }
        mesh
    }

    pub fn cuboid(half_extents_m: Vector) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let mut normal = Vector::ZERO;
                normal[axis] = sign;
                let mut u = Vector::ZERO;
                u[(axis + 1) % 3] = 1.0;
                let v = normal.cross(u);
                let first = mesh.vertices.len() as u32;
                for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                    let corner = normal + u * a + v * b;
                    mesh.vertices.push(Vertex::new(corner * half_extents_m, normal));
                }
                mesh.triangles.push([first, first + 1, first + 2]);
                mesh.triangles.push([first, first + 2, first + 3]);
            }
        }
        mesh
    }

    /// Returns a rectangle at z = 0; an extent of 0 means unbounded.
    pub fn plane(half_extents_m: [f32; 2]) -> TriangleMesh {
        let [x, y] = half_extents_m.map(|half_m| if half_m > 0.0 { half_m } else { PLANE_M });
        let corners = [(-x, -y), (x, -y), (x, y), (-x, y)];
        let vertex = |(x, y)| Vertex::new(Vector::new(x, y, 0.0), Vector::Z);
        TriangleMesh { vertices: corners.map(vertex).to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] }
    }

    /// Returns triangles with flat faces.
    pub fn faceted(points_m: &[Vector], triangles: &[[u32; 3]]) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| points_m[corner as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend([a, b, c].map(|position_m| Vertex::new(position_m, normal)));
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        mesh
    }

    /// Returns the triangles of a file's mesh. Where the file gives no normals, they are smooth except at
    /// sharp edges.
    fn of_file(file: &Mesh) -> TriangleMesh {
        let mut mesh = TriangleMesh::faceted(&file.vertices_m, &file.triangles);
        let is_given = |normals: &[Vector; 3]| normals.iter().all(|normal| *normal != Vector::ZERO);
        let smooth = match file.corner_normal.is_empty() || !file.corner_normal.iter().all(is_given) {
            true => smooth_normals(file),
            false => Vec::new(),
        };
        for (vertex, normal) in mesh.vertices.iter_mut().zip(smooth.as_flattened()) {
            vertex.normal = *normal;
        }
        for (vertex, normal) in mesh.vertices.iter_mut().zip(file.corner_normal.as_flattened()) {
            if *normal != Vector::ZERO {
                vertex.normal = *normal;
            }
        }
        for (vertex, uv) in mesh.vertices.iter_mut().zip(file.corner_uv.as_flattened()) {
            vertex.uv = *uv;
        }
        mesh
    }

    /// Removes the texture coordinates.
    pub fn without_uvs(mut self) -> TriangleMesh {
        self.vertices.iter_mut().for_each(|vertex| vertex.uv = [0.0; 2]);
        self
    }

    /// Returns the centre and the radius of a sphere around the mesh.
    pub fn bounds(&self) -> (Vector, f32) {
        let [low, high] = self.corners_m();
        ((low + high) * 0.5, (high - low).length() * 0.5)
    }

    /// Returns the corners of the mesh's bounding box: the smallest coordinates, then the largest.
    pub fn corners_m(&self) -> [Vector; 2] {
        let points = self.vertices.iter().map(|vertex| vertex.position_m);
        [points.clone().fold(Vector::INFINITY, Vector::min), points.fold(Vector::NEG_INFINITY, Vector::max)]
    }

    /// Returns the number of the axis along which the mesh is longest.
    pub fn longest_axis(&self) -> usize {
        let [low, high] = self.corners_m();
        (high - low).max_position()
    }

    /// Returns a capsule of `rings` bands, which is a sphere if its length is 0.
    fn round(rings: u32, radius_m: f32, half_length_m: f32) -> TriangleMesh {
        let (mut mesh, segments) = (TriangleMesh::default(), 2 * rings);
        for ring in 0..=rings {
            let polar_rad = PI * ring as f32 / rings as f32;
            let upper = 2 * ring <= rings;
            mesh.ring(polar_rad, radius_m, if upper { half_length_m } else { -half_length_m }, segments);
            if 2 * ring == rings && half_length_m > 0.0 {
                mesh.ring(polar_rad, radius_m, -half_length_m, segments);
            }
        }
        let circles = mesh.vertices.len() as u32 / (segments + 1);
        for circle in 0..circles - 1 {
            mesh.join(circle * (segments + 1), (circle + 1) * (segments + 1), segments);
        }
        mesh
    }

    /// Adds one circle of a sphere, moved along z.
    fn ring(&mut self, polar_rad: f32, radius_m: f32, shift_m: f32, segments: u32) {
        // Rounding makes the sine negative at the lower pole, where all points must coincide.
        let across = polar_rad.sin().max(0.0);
        for i in 0..=segments {
            let (sin, cos) = (TAU * i as f32 / segments as f32).sin_cos();
            let normal = Vector::new(across * cos, across * sin, polar_rad.cos());
            let position_m = normal * radius_m + Vector::new(0.0, 0.0, shift_m);
            self.vertices.push(Vertex::new(position_m, normal));
        }
    }

    /// Adds a band of triangles between two circles, the upper one first.
    fn join(&mut self, upper: u32, lower: u32, segments: u32) {
        for i in 0..segments {
            let (a, b, c, d) = (upper + i, upper + i + 1, lower + i, lower + i + 1);
            for triangle in [[a, c, d], [a, d, b]] {
                let [p, q, r] = triangle.map(|corner| self.vertices[corner as usize].position_m);
                if (q - p).cross(r - p).length_squared() > 0.0 {
                    self.triangles.push(triangle);
                }
            }
        }
    }
}
