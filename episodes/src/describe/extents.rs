//! Extents of geoms along the axes of a frame.

use tandem_sim::mjcf::{Geom, Primitive};
use tandem_sim::{Pose, Rotation, Vector};

/// Returns the lowest and highest coordinates of points along the axes of a frame that is turned by
/// `-yaw_rad` about z.
pub fn extent_m(points_m: impl Iterator<Item = Vector>, yaw_rad: f32) -> [Vector; 2] {
    let turn = Rotation::from_rotation_z(yaw_rad);
    points_m
        .map(|point_m| turn * point_m)
        .fold([Vector::INFINITY, Vector::NEG_INFINITY], |[low_m, high_m], point_m| {
            [low_m.min(point_m), high_m.max(point_m)]
        })
}

/// Returns the corners of a geom's bounding box, or its vertices, in the frame of `frame_from_body`.
pub fn corners_m(geom: &Geom, frame_from_body: &Pose) -> Vec<Vector> {
    let pose = *frame_from_body * geom.body_from_geom;
    let of_box = |half_m: Vector| -> Vec<Vector> {
        let sign = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
        let signs = |corner: usize| Vector::new(sign(corner, 0), sign(corner, 1), sign(corner, 2));
        (0..8).map(|corner| signs(corner) * half_m).collect()
    };
    let points_m: Vec<Vector> = match &geom.primitive {
        Primitive::Sphere { radius_m } => of_box(Vector::splat(*radius_m)),
        Primitive::Capsule { radius_m, half_length_m } => {
            of_box(Vector::new(*radius_m, *radius_m, half_length_m + radius_m))
        }
        Primitive::Cylinder { radius_m, half_length_m } => {
            of_box(Vector::new(*radius_m, *radius_m, *half_length_m))
        }
        Primitive::Box { half_extents_m } => of_box(*half_extents_m),
        Primitive::Ellipsoid { radii_m } => of_box(*radii_m),
        Primitive::Convex { vertices_m } => vertices_m.clone(),
        Primitive::Mesh(mesh) => mesh.vertices_m.clone(),
        Primitive::Plane { .. } => Vec::new(),
    };
    points_m.into_iter().map(|point_m| pose * point_m).collect()
}
