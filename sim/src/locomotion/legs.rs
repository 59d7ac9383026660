//! Leg kinematics: forward, and damped least squares inverse of one six-joint leg.

use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::na::{SMatrix, SVector};

use crate::Side;
use crate::robot::{LEG_JOINTS, LEGS, RobotModel};

pub(super) type LegAngles = [f32; LEG_JOINTS];

/// Largest change of a joint in one iteration: the linearisation holds within it.
const MAX_STEP_RAD: f32 = 0.3;
const DAMPING: f32 = 1e-5;

/// Rotation vector (axis times angle, shortest way) of a rotation.
pub(super) fn rotation_vector_rad(rotation: Rotation) -> Vector {
    let q = if rotation.w < 0.0 { -rotation } else { rotation };
    let sine = Vector::new(q.x, q.y, q.z);
    let length = sine.length();
    if length < 1e-6 { sine * 2.0 } else { sine * (2.0 * length.atan2(q.w) / length) }
}

/// Joint origins, joint axes and foot pose for a pelvis pose and leg angles.
fn forward(
    model: &RobotModel,
    side: Side,
    pelvis: Pose,
    q_rad: &LegAngles,
) -> ([Vector; LEG_JOINTS], [Vector; LEG_JOINTS], Pose) {
    let mut frame = pelvis;
    let mut origins = [Vector::ZERO; LEG_JOINTS];
    let mut axes = [Vector::ZERO; LEG_JOINTS];
    for i in 0..LEG_JOINTS {
        let joint = &model.joints[LEGS[side] + i];
        frame *= model.links[joint.link].parent_from_link;
        origins[i] = frame.translation;
        axes[i] = frame.rotation * joint.axis;
        frame *= Pose::from_rotation(Rotation::from_axis_angle(joint.axis, q_rad[i]));
    }
    (origins, axes, frame)
}

/// Leg angles that put the ankle roll link at `foot` (world) for a pelvis at `pelvis` (world), starting from
/// `start_rad`:  (J^T J + damping I) dq = J^T e, with e = [position error m; rotation error rad].
pub(super) fn inverse(
    model: &RobotModel,
    side: Side,
    pelvis: Pose,
    foot: Pose,
    start_rad: &LegAngles,
    iterations: usize,
) -> LegAngles {
    let mut q_rad = *start_rad;
    for _ in 0..iterations {
        let (origins, axes, reached) = forward(model, side, pelvis, &q_rad);
        let position = foot.translation - reached.translation;
        let rotation = rotation_vector_rad(foot.rotation * reached.rotation.inverse());
        let error = SVector::<f32, 6>::from_row_slice(&[
            position.x, position.y, position.z, rotation.x, rotation.y, rotation.z,
        ]);
        let mut jacobian = SMatrix::<f32, 6, 6>::zeros();
        for i in 0..LEG_JOINTS {
            let linear = axes[i].cross(reached.translation - origins[i]);
            let column = [linear.x, linear.y, linear.z, axes[i].x, axes[i].y, axes[i].z];
            jacobian.set_column(i, &SVector::from(column));
        }
        let normal = jacobian.transpose() * jacobian + SMatrix::identity() * DAMPING;
        let Some(factor) = normal.cholesky() else { break };
        let step = factor.solve(&(jacobian.transpose() * error));
        for i in 0..LEG_JOINTS {
            let joint = &model.joints[LEGS[side] + i];
            let moved = q_rad[i] + step[i].clamp(-MAX_STEP_RAD, MAX_STEP_RAD);
            q_rad[i] = moved.clamp(joint.lower_rad, joint.upper_rad);
        }
    }
    q_rad
}
