//! All bodies in one state: the room, whose hierarchy is built once, and moving bodies at their poses. For
//! each state, a small hierarchy is built over the moving bodies.

pub mod body;

use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::RayHit;
use rapier3d::glamx::{Mat3A, Vec3A};
use rapier3d::math::{Pose, Vector};

use body::{Body, BodyHit, BodyPoint, MetSides, PointUv, TracedRay};

/// Distance from a surface at which rays that leave it start.
const OFF_M: f32 = 2e-4;

/// Bodies at their poses.
pub struct Space<'a> {
    room: &'a Body,
    things: Vec<Thing<'a>>,
    bvh: CwBvh,
}

/// A moving body, whose triangles are in its own frame.
struct Thing<'a> {
    body: &'a Body,
    body_from_world: Mat3A,
    body_in_world_m: Vec3A,
}

/// A surface that a ray meets; `thing` is `None` for the room.
pub struct Hit {
    thing: Option<u32>,
    hit: BodyHit,
}

/// A point that a ray meets.
#[derive(Clone, Copy)]
pub struct Spot {
    pub part: u32,
    pub point_m: Vector,
    /// Start of the rays that leave the surface.
    pub start_m: Vector,
    /// Normal on the side of the ray's origin, like [`Spot::face_normal`].
    pub normal: Vector,
    pub face_normal: Vector,
    pub uv: PointUv,
}

impl<'a> Space<'a> {
    pub fn new(room: &'a Body, bodies: impl Iterator<Item = (&'a Body, Pose)>) -> Space<'a> {
        let things: Vec<Thing> = bodies.map(|(body, pose)| Thing::new(body, pose)).collect();
        let boxes: Vec<Aabb> = things.iter().map(Thing::bounds).collect();
        let mut build_time = Duration::ZERO;
        let bvh = build_cwbvh(&boxes, BvhBuildParams::fast_build(), &mut build_time);
        Space { room, things, bvh }
    }

    /// Returns the nearest surface that a ray meets, and the distance in lengths of its direction, from
    /// `least_m` on.
    #[inline]
    pub fn nearest(
        &self,
        origin_m: Vector,
        ray: Vector,
        least_m: f32,
        sides: MetSides,
    ) -> Option<(f32, Hit)> {
        let (origin_m, direction) = (origin_m.into(), ray.into());
        let mut ray = TracedRay { origin_m, direction, least_m, most_m: f32::INFINITY };
        let mut nearest = self.room.nearest(&ray, sides).map(|hit| Hit { thing: None, hit });
        if let Some(Hit { hit, .. }) = &nearest {
            ray.most_m = hit.reach_m;
        }
        self.bvh.ray_traverse(ray.traversed(), &mut RayHit::none(), |traversed, number| {
            let number = self.bvh.primitive_indices[number];
            let thing = &self.things[number as usize];
            let ray = TracedRay { most_m: traversed.tmax, ..ray };
            let Some(hit) = thing.body.nearest(&thing.enter(&ray), sides) else { return f32::INFINITY };
            nearest = Some(Hit { thing: Some(number), hit });
            hit.reach_m
        });
        nearest.map(|nearest| (nearest.hit.reach_m, nearest))
    }

    /// Returns true if there is a surface between a point and the point `reach_m` away in a direction.
    #[inline]
    pub fn is_blocked(&self, origin_m: Vector, direction: Vector, reach_m: f32) -> bool {
        let (origin_m, direction) = (origin_m.into(), direction.into());
        let ray = TracedRay { origin_m, direction, least_m: 0.0, most_m: reach_m };
        self.room.blocks(&ray)
            || !self.bvh.ray_traverse_miss(ray.traversed(), |_, number| {
                let thing = &self.things[self.bvh.primitive_indices[number] as usize];
                if thing.body.blocks(&thing.enter(&ray)) { 0.0 } else { f32::INFINITY }
            })
    }

    /// Returns the point where a ray meets a surface.
    pub fn spot(&self, origin_m: Vector, direction: Vector, Hit { thing, hit }: &Hit) -> Spot {
        let (origin_m, direction) = (origin_m.into(), direction.into());
        let ray = TracedRay { origin_m, direction, least_m: 0.0, most_m: f32::INFINITY };
        let BodyPoint { part, point_m, curved_m, normal, face_normal, uv } = match thing {
            None => self.room.point(&ray, *hit),
            Some(number) => {
                let thing = &self.things[*number as usize];
                thing.leave(thing.body.point(&thing.enter(&ray), *hit))
            }
        };
        let face_normal = face_normal * -1f32.copysign(face_normal.dot(ray.direction));
        let normal = normal * 1f32.copysign(normal.dot(face_normal));
        // Seen from inside, a curved surface is on the other side of its triangle.
        let outside = (curved_m - point_m).dot(face_normal) > 0.0;
        let start_m = if outside { curved_m } else { point_m } + face_normal * OFF_M;
        Spot {
            part,
            point_m: point_m.into(),
            start_m: start_m.into(),
            normal: normal.into(),
            face_normal: face_normal.into(),
            uv,
        }
    }
}

impl Thing<'_> {
    fn new(body: &Body, world_from_body: Pose) -> Thing<'_> {
        Thing {
            body,
            body_from_world: Mat3A::from_quat(world_from_body.rotation.inverse()),
            body_in_world_m: world_from_body.translation.into(),
        }
    }

    /// Returns a ray in the frame of the body.
    #[inline(always)]
    fn enter(&self, ray: &TracedRay) -> TracedRay {
        let origin_m = self.body_from_world * (ray.origin_m - self.body_in_world_m);
        TracedRay { origin_m, direction: self.body_from_world * ray.direction, ..*ray }
    }

    /// Returns a point of the body in the world.
    fn leave(&self, point: BodyPoint) -> BodyPoint {
        let world_from_body = self.body_from_world.transpose();
        BodyPoint {
            part: point.part,
            point_m: world_from_body * point.point_m + self.body_in_world_m,
            curved_m: world_from_body * point.curved_m + self.body_in_world_m,
            normal: world_from_body * point.normal,
            face_normal: world_from_body * point.face_normal,
            uv: PointUv {
                gradients: point.uv.gradients.map(|gradient| world_from_body * gradient),
                ..point.uv
            },
        }
    }

    /// Returns the bounding box in the world.
    fn bounds(&self) -> Aabb {
        let [low_m, high_m] = self.body.box_m.map(Vec3A::from);
        let (middle_m, half_m) = ((low_m + high_m) * 0.5, (high_m - low_m) * 0.5);
        let world_from_body = self.body_from_world.transpose();
        let middle_m = world_from_body * middle_m + self.body_in_world_m;
        let half_m = world_from_body.abs() * half_m;
        let [low_m, high_m] = [middle_m - half_m, middle_m + half_m].map(|corner_m| corner_m.to_array());
        Aabb::new(low_m.into(), high_m.into())
    }
}
