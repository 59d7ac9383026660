//! Sources of light: lamps under the ceiling of a room or, in the open, the sun; and a sky above.

use std::f32::consts::PI;

use rapier3d::math::Vector;

use super::directions::circle;
use super::space::body::{Body, MetSides, TracedRay};
use crate::mjcf::{FileLight, Headlight, LightKind};
use crate::render::shading::lamps::{arriving, linear_light};
use crate::render::{Carrier, Lamps, Light, PlacedScenery, Scenery};

/// Half extents of a lamp, which faces down, and its maximum height.
const LAMP_HALF_M: [f32; 2] = [0.9, 0.6];
const LAMP_HEIGHT_M: f32 = 2.75;
/// Height at which the light of the lamps comes from [`Light::sun_direction`].
const TABLE_HEIGHT_M: f32 = 0.8;
/// Distance of lamps from a ceiling, and minimum height of a ceiling.
const CEILING_GAP_M: f32 = 0.02;
const CEILING_FROM_M: f32 = 1.9;
/// Distance between lamps, for rooms that need several.
const LAMP_PITCH_M: f32 = 4.0;
const MAX_LAMPS_A_SIDE: usize = 4;
/// Height above which a part of the room counts as wall, and the maximum extent of a room.
const WALL_HEIGHT_M: f32 = 1.0;
const MAX_ROOM_M: f32 = 40.0;

/// Radiance of lamps and sky, as multiples of the rasterisers' light. Only their ratio matters: images are
/// exposed for the room.
const LAMP_GAIN: f32 = 10.0;
const SKY_GAIN: f32 = 1.75;
/// Tangent of the sun's angular radius; larger than in reality, as on a day with thin clouds.
const SUN_RADIUS_TAN: f32 = 0.03;

/// The light of a scenery.
#[derive(Clone)]
pub struct Lights {
    sources: Sources,
    light: Light,
}

#[derive(Clone)]
enum Sources {
    /// Centres of the lamps.
    Lamps(Vec<Vector>),
    Sun,
    /// Lights of the scene's file, and its headlight.
    Stated(Vec<FileLight>, Headlight),
}

/// Light from a point of a source, if no surface is in between.
pub struct Beam {
    pub direction: Vector,
    pub reach_m: f32,
    /// Irradiance on a surface that faces the source, divided by pi.
    pub rgb: Vector,
}

impl Lights {
    pub fn of(scenery: &Scenery, room: &Body) -> Lights {
        let light = scenery.light;
        let sources = match walls_m(scenery) {
            Some(box_m) => Sources::Lamps(lamps_m(box_m, light.sun_direction, room)),
            None => Sources::Sun,
        };
        Lights { sources, light }
    }

    /// Returns the lights at their poses in a state. Only lights of a file can move.
    pub fn placed(&self, lamps: Option<&Lamps>, placed: &PlacedScenery) -> Lights {
        match lamps {
            None => self.clone(),
            Some(lamps) => {
                Lights { sources: Sources::Stated(placed.lights.clone(), lamps.headlight), light: self.light }
            }
        }
    }

    /// Returns the lights of the scene's file.
    pub fn stated(&self) -> &[FileLight] {
        match &self.sources {
            Sources::Stated(lights, _) => lights,
            Sources::Lamps(_) | Sources::Sun => &[],
        }
    }

    /// Returns the light of the headlight on a surface, divided by pi, as [`Beam::rgb`].
    pub fn headlight_rgb(&self, facing_share: f32) -> Vector {
        match &self.sources {
            Sources::Stated(_, headlight) => linear_light(headlight.diffuse_rgb) * facing_share.max(0.0),
            Sources::Lamps(_) | Sources::Sun => Vector::ZERO,
        }
    }

    /// Returns the radiance of the sky in a direction.
    pub fn sky_rgb(&self, direction: Vector) -> Vector {
        if let Sources::Stated(lights, headlight) = &self.sources {
            let ambient_rgb = lights.iter().map(|light| light.ambient_rgb).sum::<Vector>();
            return linear_light(headlight.ambient_rgb + ambient_rgb);
        }
        let Light { below_rgb, above_rgb, .. } = self.light;
        if direction.z > 0.0 { above_rgb * SKY_GAIN } else { below_rgb }
    }

    /// Samples a point of a source that may light `point_m`.
    pub fn beam(&self, point_m: Vector, [u, v]: [f32; 2]) -> Beam {
        match &self.sources {
            Sources::Lamps(lamps_m) => self.lamp_beam(lamps_m, point_m, [u, v]),
            Sources::Stated(lights, _) => stated_beam(lights, point_m, u),
            Sources::Sun => {
                let [cosine, sine] = circle(v);
                let [right, ahead] = super::directions::across(self.light.sun_direction);
                let aside = (right * cosine + ahead * sine) * (u.sqrt() * SUN_RADIUS_TAN);
                let direction = (self.light.sun_direction + aside).normalize();
                Beam { direction, reach_m: f32::INFINITY, rgb: self.light.sun_rgb }
            }
        }
    }

    /// Samples a lamp, and then a point on that lamp. The probability of a lamp is proportional to the
    /// inverse fourth power of its distance, which is roughly proportional to its light.
    fn lamp_beam(&self, lamps_m: &[Vector], point_m: Vector, [u, v]: [f32; 2]) -> Beam {
        let weight = |lamp_m: &Vector| 1.0 / lamp_m.distance_squared(point_m).powi(2).max(1e-3);
        let sum = lamps_m.iter().map(weight).sum::<f32>();
        let (mut drawn, mut rest) = (0, u * sum);
        while drawn + 1 < lamps_m.len() && rest >= weight(&lamps_m[drawn]) {
            rest -= weight(&lamps_m[drawn]);
            drawn += 1;
        }
        let probability = weight(&lamps_m[drawn]) / sum;
        let u = (rest / weight(&lamps_m[drawn])).min(1.0);
        let [half_x_m, half_y_m] = LAMP_HALF_M;
        let on_lamp_m = Vector::new((2.0 * u - 1.0) * half_x_m, (2.0 * v - 1.0) * half_y_m, 0.0);
        let towards_m = lamps_m[drawn] + on_lamp_m - point_m;
        let reach_m = towards_m.length().max(1e-3);
        let direction = towards_m / reach_m;
        let area_m2 = 4.0 * half_x_m * half_y_m;
        let seen_share = direction.z.max(0.0) * area_m2 / (PI * reach_m * reach_m * probability);
        Beam { direction, reach_m, rgb: self.light.sun_rgb * (LAMP_GAIN * seen_share) }
    }
}

/// Samples a light of a file, with a probability proportional to its light at a point.
fn stated_beam(lights: &[FileLight], point_m: Vector, draw_value: f32) -> Beam {
    let weight = |light: &FileLight| light.diffuse_rgb.element_sum() * arriving(light, point_m).2;
    let sum = lights.iter().map(weight).sum::<f32>();
    let mut rest = draw_value * sum;
    let mut drawn = lights.iter().filter(|light| weight(light) > 0.0).peekable();
    while let Some(light) = drawn.next() {
        let own = weight(light);
        if rest < own || drawn.peek().is_none() {
            let (direction, distance_m, share) = arriving(light, point_m);
            let reach_m = match (light.casts_shadow, light.kind) {
                (false, _) => 0.0,
                (true, LightKind::Directional) => f32::INFINITY,
                (true, LightKind::Spot | LightKind::Point) => distance_m,
            };
            return Beam { direction, reach_m, rgb: linear_light(light.diffuse_rgb * share) * (sum / own) };
        }
        rest -= own;
    }
    Beam { direction: Vector::Z, reach_m: 0.0, rgb: Vector::ZERO }
}

/// Returns the bounding box of the walls and all other parts of the room of that height. Returns `None`
/// outdoors.
pub fn walls_m(scenery: &Scenery) -> Option<[Vector; 2]> {
    let mut box_m = None;
    for part in scenery.parts.iter().filter(|part| part.carrier == Carrier::Room) {
        let points_m = part.mesh.vertices.iter().map(|vertex| part.carrier_from_mesh * vertex.position_m);
        let [low_m, high_m] = points_m
            .fold([Vector::INFINITY, Vector::NEG_INFINITY], |[low_m, high_m], point_m| {
                [low_m.min(point_m), high_m.max(point_m)]
            });
        let size_m = high_m - low_m;
        if size_m.z > WALL_HEIGHT_M && size_m.max_element() < MAX_ROOM_M {
            let [lowest_m, highest_m] = box_m.unwrap_or([low_m, high_m]);
            box_m = Some([low_m.min(lowest_m), high_m.max(highest_m)]);
        }
    }
    box_m
}

/// Returns the positions of a room's lamps: a grid in the middle, shifted towards the sun's direction.
fn lamps_m([low_m, high_m]: [Vector; 2], sun_direction: Vector, room: &Body) -> Vec<Vector> {
    let count = |extent_m: f32| ((extent_m / LAMP_PITCH_M).round() as usize).clamp(1, MAX_LAMPS_A_SIDE);
    let size_m = high_m - low_m;
    let [columns, rows] = [count(size_m.x), count(size_m.y)];
    let above_table = sun_direction * ((LAMP_HEIGHT_M - TABLE_HEIGHT_M) / sun_direction.z);
    let place_m = |column: usize, row: usize| {
        let share =
            Vector::new((column as f32 + 0.5) / columns as f32, (row as f32 + 0.5) / rows as f32, 0.0);
        let [half_x_m, half_y_m] = LAMP_HALF_M;
        let half_m = Vector::new(half_x_m, half_y_m, 0.0);
        let lamp_m = (low_m + size_m * share + above_table).max(low_m + half_m).min(high_m - half_m);
        Vector::new(lamp_m.x, lamp_m.y, ceiling_m(room, lamp_m).min(LAMP_HEIGHT_M))
    };
    (0..columns)
        .flat_map(|column| (0..rows).map(move |row| (column, row)))
        .map(|(c, r)| place_m(c, r))
        .collect()
}

/// Returns the maximum height of a lamp below the ceiling at a place; infinity without a ceiling.
fn ceiling_m(room: &Body, place_m: Vector) -> f32 {
    let from_m = Vector::new(place_m.x, place_m.y, CEILING_FROM_M);
    let (origin_m, direction) = (from_m.into(), Vector::Z.into());
    let ray = TracedRay { origin_m, direction, least_m: 0.0, most_m: f32::INFINITY };
    room.nearest(&ray, MetSides::Both)
        .map_or(f32::INFINITY, |hit| CEILING_FROM_M + hit.reach_m - CEILING_GAP_M)
}
