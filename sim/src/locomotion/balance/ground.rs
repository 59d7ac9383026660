//! Ground reaction forces: how two planted feet share a wanted net force, and the leg torques that
//! produce it.

#[cfg(test)]
mod tests;

use rapier3d::math::{Pose, Vector};

use crate::body::{BodyEstimate, BodyScale, LEG_JOINTS, LEGS};
use crate::plane::flat;
use crate::{Side, Sides};

/// Force on one foot and its point of application on the ground, world frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootForce {
    pub force_n: Vector,
    pub point_m: Vector,
}

/// Half extents of the sole's area for the centre of pressure, along and across the foot.
const SOLE_HALF_LENGTH_M: f32 = 0.075;
const SOLE_HALF_WIDTH_M: f32 = 0.022;
/// Minimum share of the load on a foot: neither foot ever loses contact while standing.
const SMALLEST_SHARE: f32 = 0.03;
/// Vertical force below which the centre of pressure is undefined.
const SMALLEST_VERTICAL_FORCE_N: f32 = 20.0;

/// Returns the point midway between two soles.
pub(super) fn middle_m(soles: &Sides<Pose>) -> Vector {
    (soles.left.translation + soles.right.translation) * 0.5
}

/// Returns the point nearest to `point_m` that two planted feet can have as their centre of pressure.
pub(super) fn nearest_support_m(scale: &BodyScale, point_m: Vector, soles: Sides<Pose>) -> Vector {
    let share = share(point_m, soles);
    let middle_m = between_m(soles, share);
    let turn = soles.right.rotation.slerp(soles.left.rotation, share.left);
    let inside_m = within_sole_m(scale, turn.inverse() * flat(point_m - middle_m));
    middle_m + flat(turn * inside_m)
}

/// Returns the share of each foot in a load that acts at a point of the line between the soles.
fn share(point_m: Vector, soles: Sides<Pose>) -> Sides<f32> {
    let across = flat(soles.left.translation - soles.right.translation);
    let along_line = flat(point_m - soles.right.translation).dot(across) / across.length_squared();
    let left = along_line.clamp(SMALLEST_SHARE, 1.0 - SMALLEST_SHARE);
    Sides { left, right: 1.0 - left }
}

/// Returns the point of the line between the soles at which a load has these shares.
fn between_m(soles: Sides<Pose>, share: Sides<f32>) -> Vector {
    soles.left.translation * share.left + soles.right.translation * share.right
}

/// Returns the point of a sole nearest to `point_in_sole_m`, in the sole's frame.
fn within_sole_m(scale: &BodyScale, point_in_sole_m: Vector) -> Vector {
    let length_m = scale.along_sole_m(SOLE_HALF_LENGTH_M);
    let width_m = scale.across_sole_m(SOLE_HALF_WIDTH_M);
    Vector::new(point_in_sole_m.x.clamp(-length_m, length_m), point_in_sole_m.y.clamp(-width_m, width_m), 0.0)
}

/// Returns the net force nearest to `force_n` whose centre of pressure is within the feet, given a
/// moment about the centre of mass. An upright trunk matters more than the robot's drift.
pub(super) fn supported_force_n(
    scale: &BodyScale,
    com_m: Vector,
    force_n: Vector,
    moment_n_m: Vector,
    soles: Sides<Pose>,
) -> Vector {
    let pressure_m = centre_of_pressure_m(scale, com_m, force_n, moment_n_m, soles);
    let height_m = com_m.z - pressure_m.z;
    let change_m = nearest_support_m(scale, pressure_m, soles) - pressure_m;
    Vector::new(
        force_n.x - change_m.x * force_n.z / height_m,
        force_n.y - change_m.y * force_n.z / height_m,
        force_n.z,
    )
}

/// Returns the centre of pressure:
///   p = c + ( -(m_y + h f_x), m_x - h f_y ) / f_z,   h = height of c above the soles.
fn centre_of_pressure_m(
    scale: &BodyScale,
    com_m: Vector,
    force_n: Vector,
    moment_n_m: Vector,
    soles: Sides<Pose>,
) -> Vector {
    let ground_m = (soles.left.translation.z + soles.right.translation.z) * 0.5;
    let height_m = com_m.z - ground_m;
    let vertical_n = force_n.z.max(scale.force_n(SMALLEST_VERTICAL_FORCE_N));
    Vector::new(
        com_m.x - (moment_n_m.y + height_m * force_n.x) / vertical_n,
        com_m.y + (moment_n_m.x - height_m * force_n.y) / vertical_n,
        ground_m,
    )
}

/// Splits a net force (N) and a moment (N m) about the centre of mass over two feet, given by their sole
/// centres (world). The centre of pressure is shared along the line between the soles; the remainder
/// moves each foot's own centre.
pub(super) fn distribute(
    scale: &BodyScale,
    com_m: Vector,
    force_n: Vector,
    moment_n_m: Vector,
    soles: Sides<Pose>,
) -> Sides<FootForce> {
    let pressure_m = centre_of_pressure_m(scale, com_m, force_n, moment_n_m, soles);
    let ground_m = pressure_m.z;
    let share = share(pressure_m, soles);
    let rest_m = flat(pressure_m - between_m(soles, share));
    Sides::from_fn(|side| {
        let sole = soles[side];
        let inside_m = within_sole_m(scale, sole.rotation.inverse() * rest_m);
        let point_m = sole.translation + sole.rotation * inside_m;
        FootForce { force_n: force_n * share[side], point_m: Vector::new(point_m.x, point_m.y, ground_m) }
    })
}

/// Returns the force (N) on the left foot that, with the opposite force on the right foot, gives a moment
/// about the vertical:
///   d x f = m z,   d from the right sole to the left one.
pub(super) fn couple_n(moment_n_m: f32, soles: Sides<Pose>) -> Vector {
    let apart_m = flat(soles.left.translation - soles.right.translation);
    Vector::Z.cross(apart_m) * (moment_n_m / apart_m.length_squared())
}

/// Returns the torques with which a leg pushes on the ground so that the ground reacts with `foot` and a
/// free moment: tau = -J^T [f; m].
pub(super) fn leg_torques_n_m(
    body: &BodyEstimate,
    side: Side,
    foot: FootForce,
    free_moment_n_m: Vector,
) -> [f32; LEG_JOINTS] {
    std::array::from_fn(|i| {
        let joint = LEGS[side] + i;
        let (_, axis) = body.joint_axis(joint);
        -body.moment_n_m(joint, foot.point_m, foot.force_n) - axis.dot(free_moment_n_m)
    })
}
