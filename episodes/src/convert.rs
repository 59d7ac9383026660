//! Conversions between wire types and simulator or kinematics types.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use tandem_sim::render::Distortion;
use tandem_sim::{BaseCommand, BaseLimits, Pose, Rotation, Vector};
use tandem_tools_spec as wire;

/// Converts wire arrays to a rigid transform. The caller has checked that the quaternion's norm is
/// positive.
pub fn isometry(position_m: [f64; 3], quaternion_wxyz: [f64; 4]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(position_m), unit_quaternion(quaternion_wxyz))
}

/// Converts a wire array to a rotation. The caller has checked that the quaternion's norm is positive.
pub fn unit_quaternion([w, i, j, k]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k))
}

/// Converts a pose of the simulator to a rigid transform, in m.
pub fn isometry_from_sim(pose: &Pose) -> Isometry3<f64> {
    let (t, r) = (pose.translation, pose.rotation);
    isometry([t.x, t.y, t.z].map(f64::from), [r.w, r.x, r.y, r.z].map(f64::from))
}

pub fn isometry_to_sim(pose: &Isometry3<f64>) -> Pose {
    let q = pose.rotation.as_ref();
    Pose::from_parts(
        Vector::from(<[f64; 3]>::from(pose.translation.vector).map(|part| part as f32)),
        Rotation::from_xyzw(q.i as f32, q.j as f32, q.k as f32, q.w as f32),
    )
}

/// Converts a pose to its wire form with six decimals, for programs.
pub fn wire_pose(pose: &Isometry3<f64>) -> wire::Pose {
    pose_to(6, pose)
}

/// Converts a pose to its wire form with three decimals (millimetres), for language models. No hand is
/// steered more finely, and each further digit costs tokens.
pub fn coarse_pose(pose: &Isometry3<f64>) -> wire::Pose {
    pose_to(3, pose)
}

fn pose_to(decimals: i32, pose: &Isometry3<f64>) -> wire::Pose {
    let (t, r) = (pose.translation, pose.rotation);
    wire::Pose {
        position_m: [t.x, t.y, t.z].map(|part_m| rounded_to(decimals, part_m)),
        quaternion_wxyz: [r.w, r.i, r.j, r.k].map(|part| rounded_to(decimals, part)),
    }
}

/// Rounds to three decimals: millimetres and milliradians.
pub fn coarse(value: f64) -> f64 {
    rounded_to(3, value)
}

/// Rounds to six decimals. Zero has no sign: `-0.0` would look meaningful.
pub fn rounded(value: f64) -> f64 {
    rounded_to(6, value)
}

/// Rounds to `decimals` decimals, for values that are estimated or measured coarsely.
pub fn rounded_to(decimals: i32, value: f64) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale + 0.0
}

pub fn wire_pose_from_sim(pose: &Pose) -> wire::Pose {
    wire_pose(&isometry_from_sim(pose))
}

pub fn wire_vector(value: Vector) -> [f64; 3] {
    value.to_array().map(|value| rounded(value.into()))
}

pub fn wire_base(base: &BaseCommand) -> wire::BaseCommand {
    wire::BaseCommand {
        vx_m_s: rounded(base.vx_m_s.into()),
        vy_m_s: rounded(base.vy_m_s.into()),
        yaw_rate_rad_s: rounded(base.yaw_rate_rad_s.into()),
        pelvis_height_m: rounded(base.pelvis_height_m.into()),
    }
}

pub fn wire_limits(limits: &BaseLimits) -> wire::BaseLimits {
    let range = |[min, max]: [f32; 2]| wire::Range { min: rounded(min.into()), max: rounded(max.into()) };
    wire::BaseLimits {
        vx_m_s: range(limits.vx_m_s),
        vy_m_s: range(limits.vy_m_s),
        yaw_rate_rad_s: range(limits.yaw_rate_rad_s),
        pelvis_height_m: range(limits.pelvis_height_m),
    }
}

/// Converts the distortion of a lens; `None` if there is none.
pub fn wire_distortion(distortion: &Distortion) -> Option<wire::LensDistortion> {
    let Distortion { k1, k2, p1, p2 } = *distortion;
    (*distortion != Distortion::NONE).then(|| wire::LensDistortion {
        model: "brown_conrady".into(),
        // Rounding moves no pixel by a thousandth.
        coefficients: [k1, k2, p1, p2, 0.0].map(|part| rounded_to(8, part.into())),
    })
}

/// Converts a camera pose from MuJoCo's axes (x right, y up, looking along -z) to OpenCV's (x right, y
/// down, z forward).
pub fn opencv_axes(pelvis_from_camera: &Pose) -> Pose {
    *pelvis_from_camera * Pose::from_rotation(Rotation::from_rotation_x(std::f32::consts::PI))
}
