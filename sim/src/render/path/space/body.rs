//! Triangles that move as one, in a bounding volume hierarchy: the room, a robot's link, an object.

use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

use rapier3d::glamx::Vec3A;
use rapier3d::math::Vector;

use crate::render::{Part, Scenery};

/// Sides of triangles that a ray can meet.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum MetSides {
    /// Only the front, like a rasteriser: a camera inside its robot's head sees through the head.
    Front,
    Both,
}

/// A ray, and the range of distances in which it is traced, in lengths of its direction.
#[derive(Clone, Copy)]
pub struct TracedRay {
    pub origin_m: Vec3A,
    pub direction: Vec3A,
    pub least_m: f32,
    pub most_m: f32,
}

/// Triangles in the frame of their carrier, in the order of the hierarchy.
pub struct Body {
    bvh: CwBvh,
    corners: Vec<CornerAndEdges>,
    looks: Vec<Look>,
    /// Texture coordinates at the corners of each triangle; empty if no part has any.
    corner_uv: Vec<[[f32; 2]; 3]>,
    /// Corners of the bounding box: the smallest coordinates, then the largest.
    pub box_m: [Vector; 2],
}

/// Triangle in the form that intersection tests need.
#[derive(Clone, Copy)]
struct CornerAndEdges {
    corner_m: Vec3A,
    edges_m: [Vec3A; 2],
}

/// Normals at a triangle's corners, and its part.
#[derive(Clone, Copy)]
struct Look {
    normals: [Vec3A; 3],
    part: u32,
}

/// A triangle that a ray meets.
#[derive(Clone, Copy)]
pub struct BodyHit {
    /// Distance along the ray, in lengths of its direction.
    pub reach_m: f32,
    triangle: u32,
}

/// A point of a body's surface, in the body's frame.
pub struct BodyPoint {
    pub part: u32,
    pub point_m: Vec3A,
    /// The point on the curved surface that the triangle approximates.
    pub curved_m: Vec3A,
    /// Outward normal, interpolated between the corners.
    pub normal: Vec3A,
    /// Outward normal of the flat triangle.
    pub face_normal: Vec3A,
    pub uv: PointUv,
}

/// Texture coordinates at a point, and their mean change per metre.
#[derive(Clone, Copy, Default)]
pub struct PointUv {
    pub uv: [f32; 2],
    pub uv_1_m: f32,
    /// Directions in which each coordinate grows, of any length.
    pub gradients: [Vec3A; 2],
}

impl Body {
    /// Collects the triangles of some of a scenery's parts, by their numbers.
    pub fn of(scenery: &Scenery, parts: impl Iterator<Item = usize>) -> Body {
        let (mut corners_m, mut looks, mut corner_uv) = (Vec::new(), Vec::new(), Vec::new());
        for number in parts {
            let Part { mesh, carrier_from_mesh, .. } = &scenery.parts[number];
            for triangle in &mesh.triangles {
                let vertices = triangle.map(|corner| mesh.vertices[corner as usize]);
                corners_m.push(vertices.map(|vertex| Vec3A::from(*carrier_from_mesh * vertex.position_m)));
                let normals = vertices.map(|vertex| (carrier_from_mesh.rotation * vertex.normal).into());
                looks.push(Look { normals, part: number as u32 });
                corner_uv.push(vertices.map(|vertex| vertex.uv));
            }
        }
        // Vectors are passed as arrays, because the two libraries may use different versions of a vector's
        // type.
        let triangle = |corners_m: &[Vec3A; 3]| {
            let [v0, v1, v2] = corners_m.map(|corner_m| corner_m.to_array().into());
            Triangle { v0, v1, v2 }
        };
        let triangles: Vec<Triangle> = corners_m.iter().map(triangle).collect();
        let mut build_time = Duration::ZERO;
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut build_time);
        let order = || bvh.primitive_indices.iter().map(|number| *number as usize);
        let points_m = corners_m.as_flattened().iter().map(|point_m| Vector::from(*point_m));
        let box_m = points_m.fold([Vector::INFINITY, Vector::NEG_INFINITY], |[low_m, high_m], point_m| {
            [low_m.min(point_m), high_m.max(point_m)]
        });
        Body {
            corners: order().map(|number| CornerAndEdges::of(&corners_m[number])).collect(),
            looks: order().map(|number| looks[number]).collect(),
            corner_uv: match corner_uv.as_flattened().iter().all(|uv| *uv == [0.0; 2]) {
                true => Vec::new(),
                false => order().map(|number| corner_uv[number]).collect(),
            },
            bvh,
            box_m,
        }
    }

    /// Returns the nearest triangle that a ray meets.
    #[inline]
    pub fn nearest(&self, ray: &TracedRay, sides: MetSides) -> Option<BodyHit> {
        let mut hit = RayHit::none();
        let meet = |traversed: &Ray, number: usize| self.corners[number].meet(ray, traversed.tmax, sides);
        let is_met = self.bvh.ray_traverse(ray.traversed(), &mut hit, meet);
        is_met.then_some(BodyHit { reach_m: hit.t, triangle: hit.primitive_id })
    }

    /// Returns true if a ray meets any triangle.
    #[inline]
    pub fn blocks(&self, ray: &TracedRay) -> bool {
        let meet = |_: &Ray, number: usize| self.corners[number].meet(ray, ray.most_m, MetSides::Both);
        !self.bvh.ray_traverse_miss(ray.traversed(), meet)
    }

    /// Returns the point where a ray meets a triangle.
    pub fn point(&self, ray: &TracedRay, hit: BodyHit) -> BodyPoint {
        let CornerAndEdges { corner_m, edges_m: [first_m, second_m] } = self.corners[hit.triangle as usize];
        let Look { normals, part } = self.looks[hit.triangle as usize];
        let point_m = ray.origin_m + ray.direction * hit.reach_m;
        let [v, w] = shares(point_m - corner_m, first_m, second_m);
        let weights = [1.0 - v - w, v, w];
        let corners_m = [corner_m, corner_m + first_m, corner_m + second_m];
        let (mut normal, mut curved_m) = (Vec3A::ZERO, Vec3A::ZERO);
        for (weight, (corner_m, corner_normal)) in weights.into_iter().zip(corners_m.into_iter().zip(normals))
        {
            normal += corner_normal * weight;
            // Hanika 2021, Hacking the shadow terminator: the point on the corner's tangent plane.
            let below_m = (point_m - corner_m).dot(corner_normal).min(0.0);
            curved_m += (point_m - corner_normal * below_m) * weight;
        }
        let face_normal = first_m.cross(second_m).normalize_or_zero();
        let normal = normal.normalize_or(face_normal);
        let uv = self.corner_uv.get(hit.triangle as usize);
        let uv = uv.map(|uvs| PointUv::of(uvs, weights, [first_m, second_m]));
        BodyPoint { part, point_m, curved_m, normal, face_normal, uv: uv.unwrap_or_default() }
    }
}

impl PointUv {
    /// Blends the coordinates at the corners of a triangle with these edges.
    fn of([a, b, c]: &[[f32; 2]; 3], [at_a, at_b, at_c]: [f32; 3], edges_m: [Vec3A; 2]) -> PointUv {
        let face = edges_m[0].cross(edges_m[1]);
        let twice_area_m2 = face.length();
        let across = [edges_m[1].cross(face), face.cross(edges_m[0])];
        let edge = |to: &[f32; 2]| [to[0] - a[0], to[1] - a[1]];
        let (first, second) = (edge(b), edge(c));
        let twice_area = (first[0] * second[1] - first[1] * second[0]).abs();
        PointUv {
            uv: std::array::from_fn(|axis| a[axis] * at_a + b[axis] * at_b + c[axis] * at_c),
            uv_1_m: (twice_area / twice_area_m2.max(f32::MIN_POSITIVE)).sqrt(),
            gradients: std::array::from_fn(|axis| across[0] * first[axis] + across[1] * second[axis]),
        }
    }
}

impl TracedRay {
    /// Converts the ray for the traversal of a hierarchy.
    #[inline(always)]
    pub fn traversed(&self) -> Ray {
        let [origin_m, direction] = [self.origin_m, self.direction].map(|vector| vector.to_array());
        Ray::new(origin_m.into(), direction.into(), self.least_m, self.most_m)
    }
}

/// Returns the shares of two edges in a vector of their plane.
fn shares(inside_m: Vec3A, first_m: Vec3A, second_m: Vec3A) -> [f32; 2] {
    let (aa, ab, bb) = (first_m.dot(first_m), first_m.dot(second_m), second_m.dot(second_m));
    let (a, b) = (inside_m.dot(first_m), inside_m.dot(second_m));
    let per_area = 1.0 / (aa * bb - ab * ab).max(f32::MIN_POSITIVE);
    let v = ((bb * a - ab * b) * per_area).clamp(0.0, 1.0);
    [v, ((aa * b - ab * a) * per_area).clamp(0.0, 1.0 - v)]
}

impl CornerAndEdges {
    fn of([a_m, b_m, c_m]: &[Vec3A; 3]) -> CornerAndEdges {
        CornerAndEdges { corner_m: *a_m, edges_m: [*b_m - *a_m, *c_m - *a_m] }
    }

    /// Returns the distance at which a ray meets the triangle, if less than `most_m`; otherwise infinity.
    /// Source: Möller and Trumbore 1997.
    #[inline(always)]
    fn meet(&self, ray: &TracedRay, most_m: f32, sides: MetSides) -> f32 {
        let [first_m, second_m] = self.edges_m;
        let across = ray.direction.cross(second_m);
        let facing = first_m.dot(across);
        if facing == 0.0 || sides == MetSides::Front && facing < 0.0 {
            return f32::INFINITY;
        }
        let per_facing = 1.0 / facing;
        let from_corner_m = ray.origin_m - self.corner_m;
        let v = from_corner_m.dot(across) * per_facing;
        let around = from_corner_m.cross(first_m);
        let w = ray.direction.dot(around) * per_facing;
        let reach_m = second_m.dot(around) * per_facing;
        let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0;
        if inside && reach_m >= ray.least_m && reach_m < most_m { reach_m } else { f32::INFINITY }
    }
}
