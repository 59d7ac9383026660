//! Extents and enclosed space of rigid bodies, by their colliding shapes.

use std::fmt;

use rapier3d::math::{Pose, Vector};
use rapier3d::parry::query::Ray;
use rapier3d::prelude::SharedShape;

use crate::mjcf::Geom;

/// Number of horizontal directions tested from a point that may be enclosed. No gap between the staves of a
/// vessel is wide enough for all of them.
const HEADINGS: u32 = 16;
/// Length of test rays. No body is as wide.
const SIGHT_M: f32 = 10.0;

/// All colliding shapes of a rigid body, in its frame.
#[derive(Clone)]
pub(crate) struct Solid {
    shapes: Vec<(Pose, SharedShape)>,
}

impl Solid {
    pub fn of(geoms: &[Geom]) -> Solid {
        Solid { shapes: geoms.iter().filter(|geom| geom.collides).filter_map(Geom::collider).collect() }
    }

    /// Returns the extent of the body at `world_from_body` along a world direction (a unit vector) from the
    /// world's origin. It is the extent of the body's farthest point; negative infinity for a body without
    /// colliding shapes.
    pub fn reach_m(&self, world_from_body: &Pose, direction: Vector) -> f32 {
        let reaches_m = self.shapes.iter().filter_map(|(body_from_shape, shape)| {
            let world_from_shape = *world_from_body * *body_from_shape;
            let farthest_m =
                shape.as_support_map()?.local_support_point(world_from_shape.rotation.inverse() * direction);
            Some((world_from_shape * farthest_m).dot(direction))
        });
        reaches_m.fold(f32::NEG_INFINITY, f32::max)
    }

    /// Returns true if a point of the body's frame is in the open between walls and over a floor. That
    /// is, every ray from it that is level in the body's own frame or goes down hits the body.
    pub fn encloses(&self, point_m: Vector) -> bool {
        let solid = self.shapes.iter().any(|(pose, shape)| shape.contains_point(pose, point_m));
        let sees = |direction: Vector| {
            let ray = Ray::new(point_m, direction);
            self.shapes.iter().any(|(pose, shape)| shape.intersects_ray(pose, &ray, SIGHT_M))
        };
        let headings_rad = (0..HEADINGS).map(|i| i as f32 * std::f32::consts::TAU / HEADINGS as f32);
        let mut level =
            headings_rad.map(|heading_rad| Vector::new(heading_rad.cos(), heading_rad.sin(), 0.0));
        !solid && sees(Vector::NEG_Z) && level.all(sees)
    }
}

impl fmt::Debug for Solid {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Solid of {} shapes", self.shapes.len())
    }
}

/// Extents of every kind of shape against closed forms.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::mjcf::Document;

    /// Builds a body with one geom.
    fn body(geom: &str) -> Solid {
        let meshes = r#"<asset><mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset>"#;
        let xml = format!("<mujoco>{meshes}<worldbody>{geom}</worldbody></mujoco>");
        let document = Document::parse("body", &xml).expect("a body");
        Solid::of(&document.trees().expect("a body")[0].links[0].geoms)
    }

    #[test]
    fn a_body_reaches_as_far_as_its_farthest_point() {
        let slanted = Vector::new(0.6, 0.0, 0.8);
        for (geom, direction, reach_m) in [
            (r#"<geom size="0.2" pos="1 2 3"/>"#, Vector::X, 1.2),
            (r#"<geom size="0.2" pos="1 2 3"/>"#, slanted, 3.2),
            (r#"<geom type="box" size="0.1 0.2 0.3"/>"#, Vector::NEG_Y, 0.2),
            // 0.6 * 0.1 + 0.8 * 0.3.
            (r#"<geom type="box" size="0.1 0.2 0.3"/>"#, slanted, 0.3),
            (r#"<geom type="capsule" size="0.1 0.5"/>"#, Vector::Z, 0.6),
            (r#"<geom type="capsule" size="0.1 0.5"/>"#, slanted, 0.5),
            (r#"<geom type="cylinder" size="0.1 0.5"/>"#, Vector::Z, 0.5),
            (r#"<geom type="cylinder" size="0.1 0.5"/>"#, Vector::X, 0.1),
            // 0.6 * 0.1 + 0.8 * 0.5.
            (r#"<geom type="cylinder" size="0.1 0.5"/>"#, slanted, 0.46),
            (r#"<geom type="cylinder" fromto="0 0 0 1 0 0" size="0.1"/>"#, Vector::X, 1.0),
            (r#"<geom type="mesh" mesh="wedge"/>"#, slanted, 0.8),
            (r#"<geom type="mesh" mesh="wedge"/>"#, -slanted, 0.0),
            // Nothing collides with a shape that is only drawn.
            (r#"<geom size="0.2" contype="0" conaffinity="0"/>"#, Vector::X, f32::NEG_INFINITY),
            // The farther of two.
            (r#"<geom size="0.2"/><geom size="0.1" pos="0.3 0 0"/>"#, Vector::X, 0.4),
            (r#"<geom size="0.2"/><geom size="0.1" pos="0.3 0 0"/>"#, Vector::Y, 0.2),
        ] {
            let found_m = body(geom).reach_m(&Pose::IDENTITY, direction);
            assert!(
                found_m == reach_m || (found_m - reach_m).abs() < 1e-5,
                "{geom} along {direction}: {found_m} m"
            );
        }
    }

    #[test]
    fn a_body_that_is_turned_reaches_elsewhere() {
        use rapier3d::math::Rotation;
        let block = body(r#"<geom type="box" size="0.1 0.2 0.3" pos="0 0 0.3"/>"#);
        for (turn, direction, reach_m) in [
            (Rotation::from_rotation_x(std::f32::consts::FRAC_PI_2), Vector::NEG_Z, 0.2 - 5.0),
            (Rotation::from_rotation_x(std::f32::consts::FRAC_PI_2), Vector::NEG_Y, 0.6),
            (Rotation::from_rotation_x(std::f32::consts::PI), Vector::NEG_Z, 0.6 - 5.0),
            // An edge: 0.1 sin 30 + 0.6 cos 30.
            (Rotation::from_rotation_y(std::f32::consts::FRAC_PI_6), Vector::Z, 0.05 + 0.519_615_2 + 5.0),
        ] {
            let found_m = block.reach_m(&Pose::from_parts(Vector::Z * 5.0, turn), direction);
            assert!((found_m - reach_m).abs() < 1e-5, "{turn} along {direction}: {found_m} m");
        }
    }
}
