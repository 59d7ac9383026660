//! Feet of third-party MJCF: the frames of the links at the ends of the legs, and their soles.

use rapier3d::glamx::{DPose3, DQuat, DVec3};
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::parry::transformation::try_convex_hull;
use rapier3d::prelude::{SharedShape, TypedShape};

use super::read::corners_m;
use super::{JointModel, SiteModel};
use crate::body::layout::{LEG_JOINTS, LEGS, joint_names};
use crate::mjcf::{BodyTree, Document, Geom};
use crate::{Sides, SimError};

/// Tilt above which a sole counts as tilted with all joints at 0. Curved soles are tilted by less.
const MIN_TILT_RAD: f32 = 0.05;
/// Cosine of the maximum angle from straight down at which a face of a foot points down.
const DOWN_COSINE: f32 = 0.7;
/// Cosine of the maximum angle between faces of one plane.
const PLANE_COSINE: f32 = 0.9998;
/// Minimum share of its outline that the largest plane of a flat sole covers.
const FLAT_SHARE: f32 = 0.3;
/// Number of points around a round shape.
const ROUND_STEPS: u32 = 16;

/// Puts the origins of all bodies on the axes of their joints, and gives the feet frames along their soles: x
/// points ahead and z up, with all joints at 0. Joints have their published names. Returns the robot's tree.
pub(super) fn level_frames(document: &mut Document) -> Result<BodyTree, SimError> {
    for body in 0..document.model.bodies.len() {
        let anchor = document.model.bodies[body].body.joints.first().map(|joint| joint.pos);
        if let Some(anchor_m) = anchor.filter(|anchor_m| *anchor_m != [0.0; 3]) {
            document.reframe(body, DPose3::from_translation(DVec3::from_array(anchor_m)));
        }
    }
    let feet: Vec<usize> = LEGS.iter().filter_map(|first| foot_body(document, *first)).collect();
    for foot in &feet {
        document.let_shapes_collide(*foot);
    }
    let tree = document.robot_tree()?;
    for foot in feet {
        let Some(link) = tree.links.iter().find(|link| link.bodies[0].index == foot) else { continue };
        let rotation = root_from_body(document, foot).rotation;
        let root_from_sole = sole_tilt(rotation.as_quat(), &link.geoms).as_dquat();
        let foot_from_sole = rotation.inverse() * root_from_sole;
        if foot_from_sole.angle_between(DQuat::IDENTITY) > f64::from(MIN_TILT_RAD) {
            document.reframe(foot, DPose3::from_rotation(foot_from_sole));
        }
    }
    document.robot_tree()
}

/// Returns the body with the last joint of a leg, whose first joint is `first` in published order.
fn foot_body(document: &Document, first: usize) -> Option<usize> {
    let names = joint_names();
    let leg = &names[first..first + LEG_JOINTS];
    let is_in_leg = |name: &Option<String>| name.as_ref().is_some_and(|name| leg.contains(name));
    let bodies = &document.model.bodies;
    bodies.iter().rposition(|entry| entry.body.joints.iter().any(|joint| is_in_leg(&joint.name)))
}

/// Returns the pose of a body in the robot's root with all joints at 0.
pub(super) fn root_from_body(document: &Document, body: usize) -> DPose3 {
    let entry = &document.model.bodies[body];
    match entry.parent {
        None | Some(0) => DPose3::IDENTITY,
        Some(parent) => root_from_body(document, parent) * entry.body.pose,
    }
}

/// Returns the smallest rotation from level to the plane of a sole, for a link with this rotation in the
/// root. It is 0 if the sole is round or almost level.
fn sole_tilt(root_from_link: Rotation, geoms: &[Geom]) -> Rotation {
    let colliding = geoms.iter().filter(|geom| geom.collides).filter_map(Geom::collider);
    let points_m: Vec<Vector> = colliding
        .flat_map(|(link_from_shape, shape)| {
            let on_root = move |point: Vector| root_from_link * (link_from_shape * point);
            surface_points_m(&shape).into_iter().map(on_root)
        })
        .collect();
    let Ok((corners_m, triangles)) = try_convex_hull(&points_m) else { return Rotation::IDENTITY };
    let faces = triangles.iter().filter_map(|corners| {
        let [a, b, c] = corners.map(|corner| corners_m[corner as usize]);
        let area_m2 = (b - a).cross(c - a) * 0.5;
        Some((area_m2.try_normalize()?, area_m2.length())).filter(|(normal, _)| -normal.z > DOWN_COSINE)
    });
    let faces: Vec<(Vector, f32)> = faces.collect();
    let plane = |normal: Vector| {
        let along = faces.iter().filter(move |(other, _)| other.dot(normal) > PLANE_COSINE);
        along.map(|(_, area_m2)| area_m2).sum::<f32>()
    };
    let planes = faces.iter().map(|(normal, _)| (*normal, plane(*normal)));
    let Some((normal, area_m2)) = planes.max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Rotation::IDENTITY;
    };
    let low_m = corners_m.iter().copied().fold(Vector::INFINITY, Vector::min);
    let high_m = corners_m.iter().copied().fold(Vector::NEG_INFINITY, Vector::max);
    let outline_m2 = (high_m.x - low_m.x) * (high_m.y - low_m.y);
    let tilt = Rotation::from_rotation_arc(-Vector::Z, normal);
    let is_flat = area_m2 > FLAT_SHARE * outline_m2;
    if is_flat && tilt.angle_between(Rotation::IDENTITY) > MIN_TILT_RAD { tilt } else { Rotation::IDENTITY }
}

/// Returns points of a shape's surface. The shape is their hull.
fn surface_points_m(shape: &SharedShape) -> Vec<Vector> {
    match shape.as_typed_shape() {
        TypedShape::Cuboid(cuboid) => cuboid.to_trimesh().0,
        TypedShape::ConvexPolyhedron(hull) => hull.points().to_vec(),
        TypedShape::Ball(ball) => ball.to_trimesh(ROUND_STEPS, ROUND_STEPS).0,
        TypedShape::Capsule(capsule) => capsule.to_trimesh(ROUND_STEPS, ROUND_STEPS).0,
        TypedShape::Cylinder(cylinder) => cylinder.to_trimesh(ROUND_STEPS).0,
        // Geoms have no other shapes.
        _ => Vec::new(),
    }
}

/// Returns the middles of the areas on which the feet rest.
pub(super) fn find_soles(
    document: &Document,
    tree: &BodyTree,
    joints: &[JointModel],
) -> Result<Sides<SiteModel>, SimError> {
    let mut refused = Vec::new();
    let soles = LEGS.map(|first| {
        let links = joints[first..first + LEG_JOINTS].iter().map(|joint| joint.link);
        let foot = links.max().unwrap_or_default();
        let sole = sole(tree, foot);
        if sole.is_none() {
            let what = "is a foot without a geom that collides; give it one to stand on, for example a box";
            refused.push(document.refuse_body(tree.links[foot].bodies[0].index, what));
        }
        sole
    });
    match soles {
        Sides { left: Some(left), right: Some(right) } => Ok(Sides { left, right }),
        Sides { .. } => Err(SimError::several(refused)),
    }
}

fn sole(tree: &BodyTree, link: usize) -> Option<SiteModel> {
    let corners_m = corners_m(&tree.links[link].geoms);
    let low_m = corners_m.iter().copied().reduce(Vector::min)?;
    let high_m = corners_m.iter().copied().reduce(Vector::max)?;
    let middle_m = Vector::new(0.5 * (low_m.x + high_m.x), 0.5 * (low_m.y + high_m.y), low_m.z);
    Some(SiteModel { link, link_from_site: Pose::from_translation(middle_m) })
}
