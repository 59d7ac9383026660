//! Leg kinematics: forward, and damped least squares inverse of one six-joint leg.

use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::na::{SMatrix, SVector};

use crate::Side;
use crate::body::{LEG_JOINTS, LEGS, RobotModel};

pub(super) type LegAngles = [f32; LEG_JOINTS];

/// Maximum change of a joint in one iteration, within which the linearisation holds.
const MAX_STEP_RAD: f32 = 0.3;
const DAMPING: f32 = 1e-5;
const ANKLE_ROLL: usize = LEG_JOINTS - 1;

/// Returns the rotation vector (axis times angle, shortest way) of a rotation.
pub(super) fn rotation_vector_rad(rotation: Rotation) -> Vector {
    let q = if rotation.w < 0.0 { -rotation } else { rotation };
    let sine = Vector::new(q.x, q.y, q.z);
    let length = sine.length();
    if length < 1e-6 { sine * 2.0 } else { sine * (2.0 * length.atan2(q.w) / length) }
}

/// Returns joint origins, joint axes and foot pose for a pelvis pose and leg angles. Without an ankle roll
/// joint, the last origin and axis are those of rolling on the sole.
fn forward(
    model: &RobotModel,
    side: Side,
    pelvis: Pose,
    q_rad: &LegAngles,
) -> ([Vector; LEG_JOINTS], [Vector; LEG_JOINTS], Pose) {
    let mut frame = pelvis;
    let mut origins = [Vector::ZERO; LEG_JOINTS];
    let mut axes = [Vector::ZERO; LEG_JOINTS];
    for index in &model.leg_chains[side] {
        let (i, joint) = (index - LEGS[side], &model.joints[*index]);
        frame *= model.links[joint.link].parent_from_link;
        origins[i] = frame.translation;
        axes[i] = frame.rotation * joint.axis;
        frame *= Pose::from_rotation(Rotation::from_axis_angle(joint.axis, q_rad[i]));
    }
    if let Some((origin, axis)) = model.sole_axis(side, frame) {
        (origins[ANKLE_ROLL], axes[ANKLE_ROLL]) = (origin, axis);
    }
    (origins, axes, frame)
}

/// Returns the leg angles that put the foot's link at `foot` (world) for a pelvis at `pelvis`
/// (world), starting from `start_rad`:  (J^T J + damping I) dq = J^T e, with e = [position error m;
/// rotation error rad].
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::posed::{Posed, model};

    const ITERATIONS: usize = 40;

    fn rest_rad(side: Side) -> LegAngles {
        std::array::from_fn(|i| Posed::standing().q_rad[LEGS[side] + i])
    }

    /// Returns combinations of three angles per joint, within the limits.
    fn grid(side: Side) -> impl Iterator<Item = LegAngles> {
        const STEPS: [f32; 3] = [0.25, 0.5, 0.8];
        (0..STEPS.len().pow(LEG_JOINTS as u32)).map(move |number| {
            std::array::from_fn(|i| {
                let joint = &model().joints[LEGS[side] + i];
                let (low, high) = (joint.lower_rad.max(-0.8), joint.upper_rad.min(1.2));
                low + (high - low) * STEPS[number / STEPS.len().pow(i as u32) % STEPS.len()]
            })
        })
    }

    #[test]
    fn the_inverse_undoes_the_forward_kinematics() {
        let pelvis = Posed::tumbling(0).world_from_pelvis;
        for side in Side::BOTH {
            for q_rad in grid(side) {
                let (_, _, foot) = forward(model(), side, pelvis, &q_rad);
                let found_rad = inverse(model(), side, pelvis, foot, &rest_rad(side), ITERATIONS);
                let (_, _, reached) = forward(model(), side, pelvis, &found_rad);
                let error_m = (reached.translation - foot.translation).length();
                let error_rad = rotation_vector_rad(reached.rotation * foot.rotation.inverse()).length();
                assert!(error_m < 1e-4 && error_rad < 1e-3, "{q_rad:?}: {error_m} m, {error_rad} rad");
            }
        }
    }

    #[test]
    fn forward_kinematics_is_the_whole_robots() {
        let posed = Posed::tumbling(4);
        for side in Side::BOTH {
            let q_rad = std::array::from_fn(|i| posed.q_rad[LEGS[side] + i]);
            let (_, _, foot) = forward(model(), side, posed.world_from_pelvis, &q_rad);
            let expected = posed.body().world_from_foot(side);
            assert!((foot.translation - expected.translation).length() < 1e-5);
            assert!(rotation_vector_rad(foot.rotation * expected.rotation.inverse()).length() < 1e-3);
        }
    }

    /// A foot target is far below: the leg is stretched towards it, within its limits.
    #[test]
    fn out_of_reach_the_leg_is_stretched() {
        let pelvis = Posed::standing().world_from_pelvis;
        for side in Side::BOTH {
            let (origins, _, rest) = forward(model(), side, pelvis, &rest_rad(side));
            let hip_m = origins[1];
            let wanted = Pose::from_parts(rest.translation - Vector::Z, rest.rotation);
            let q_rad = inverse(model(), side, pelvis, wanted, &rest_rad(side), ITERATIONS);
            for (i, q_rad) in q_rad.into_iter().enumerate() {
                let joint = &model().joints[LEGS[side] + i];
                assert!((joint.lower_rad..=joint.upper_rad).contains(&q_rad), "{}: {q_rad}", joint.name);
            }
            let (origins, _, reached) = forward(model(), side, pelvis, &q_rad);
            let (thigh_m, shank_m) =
                ((origins[3] - hip_m).length(), (reached.translation - origins[3]).length());
            let length_m = (reached.translation - hip_m).length();
            assert!(length_m > 0.98 * (thigh_m + shank_m), "{length_m} m of {thigh_m} + {shank_m}");
        }
    }
}
