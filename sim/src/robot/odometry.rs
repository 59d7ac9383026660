//! How far a robot has gone, as it can tell by itself: its joints say where its feet are under the pelvis, its IMU how the
//! pelvis is tilted and how fast it turns. The lowest point of both feet carries the robot and does not move, so the pelvis does:
//!
//!   R' = level(R exp(w dt)),   t' = t + R r - R' r',
//!
//! with R the pelvis in the start frame, w the gyro's reading [rad/s], `level` the smallest turn after which down is where the
//! IMU has it, r and r' that point in the pelvis frame [m] before and after the step. Height is no sum: the floor is level,
//! and the pelvis as far above it as above the lower sole.

use rapier3d::math::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};

use crate::body::BodyEstimate;
use crate::plane::flat;

/// What a robot knows of its way since it was put into the world.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct Odometry {
    /// The estimate of the last [`Odometry::update`]; `None` before the first.
    last: Option<Estimate>,
}

/// The start frame lies on the floor under the pelvis as it was first sensed, z up, x where the pelvis faced.
#[derive(Clone, Serialize, Deserialize)]
struct Estimate {
    start_from_pelvis: Pose,
    /// Points of both feet from the pelvis, along the axes of the start frame.
    feet_m: Vec<Vector>,
}

/// What the estimate is made of; nothing of it says where in the world the robot is.
struct Sensed {
    /// What the IMU measures, in the pelvis frame.
    down_direction: Vector,
    turning_rad_s: Vector,
    /// Middles of the shapes that both feet stand on and, lower by what is between, their soles; by the joints, in the pelvis
    /// frame.
    feet_m: Vec<Vector>,
    soles_m: [Vector; 2],
}

impl Odometry {
    /// One physics step.
    pub(super) fn update(&mut self, body: &BodyEstimate, dt_s: f32) {
        self.last = Some(self.estimate(&Sensed::of(body), dt_s));
    }

    /// The pelvis in the start frame, measured as `body` one physics step after the last [`Odometry::update`].
    pub(super) fn start_from_pelvis(&self, body: &BodyEstimate, dt_s: f32) -> Pose {
        self.estimate(&Sensed::of(body), dt_s).start_from_pelvis
    }

    fn estimate(&self, sensed: &Sensed, dt_s: f32) -> Estimate {
        let rotation = self.last.as_ref().map_or(Rotation::IDENTITY, |last| {
            last.start_from_pelvis.rotation * Rotation::from_scaled_axis(sensed.turning_rad_s * dt_s)
        });
        let rotation = levelled(rotation, sensed.down_direction);
        let feet_m: Vec<Vector> = sensed.feet_m.iter().map(|point_m| rotation * *point_m).collect();
        let place_m = self.last.as_ref().map_or(Vector::ZERO, |last| {
            let pairs = last.feet_m.iter().zip(&feet_m);
            let lowest = pairs.min_by(|(_, one_m), (_, other_m)| one_m.z.total_cmp(&other_m.z));
            let moved_m = lowest.map_or(Vector::ZERO, |(before_m, now_m)| *before_m - *now_m);
            flat(last.start_from_pelvis.translation + moved_m)
        });
        let height_m = sensed.soles_m.map(|sole_m| -(rotation * sole_m).z);
        let above_m = Vector::new(0.0, 0.0, height_m[0].max(height_m[1]));
        Estimate { start_from_pelvis: Pose::from_parts(place_m + above_m, rotation), feet_m }
    }
}

impl Sensed {
    fn of(body: &BodyEstimate) -> Sensed {
        let pelvis_from_world = body.world_from_pelvis().inverse();
        let soles = &body.model.soles;
        let shapes = soles.iter().flat_map(|sole| {
            let pelvis_from_foot = pelvis_from_world * body.world_from_link[sole.link];
            let colliding = body.model.links[sole.link].geoms.iter().filter(|geom| geom.collides);
            colliding.map(move |geom| pelvis_from_foot * geom.body_from_geom.translation)
        });
        Sensed {
            down_direction: pelvis_from_world.rotation * -Vector::Z,
            turning_rad_s: pelvis_from_world.rotation * body.pelvis_angular_velocity_rad_s,
            feet_m: shapes.collect(),
            soles_m: [&soles.left, &soles.right]
                .map(|sole| pelvis_from_world * body.world_from_site(sole).translation),
        }
    }
}

/// The rotation nearest to `rotation` that turns `down_direction` to where down is.
fn levelled(rotation: Rotation, down_direction: Vector) -> Rotation {
    (Rotation::from_rotation_arc((rotation * down_direction).normalize(), -Vector::Z) * rotation).normalize()
}
