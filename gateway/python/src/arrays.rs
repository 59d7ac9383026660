//! Values of a robot as rows of an array, and the names of their columns.

use numpy::ndarray::{Dim, Dimension, IntoDimension};
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use tandem_episodes::joint_names;
use tandem_sim::{Pose, RobotCommand, RobotStep, UPPER, Vector};
use tandem_tools_spec::{Assistance, BASE_COLUMNS, DRIVE_BLOCKS};

/// Colour image: height by width by red, green, blue.
pub type Colours<'py> = Bound<'py, PyArray3<u8>>;
/// Depth image along the optical axis: height by width, in metres.
pub type Depths<'py> = Bound<'py, PyArray2<f32>>;

/// Components of a pose.
const POSE: [&str; 7] = ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"];

/// Returns the names of the columns of [`state_row`].
pub fn state_names(assistance: Assistance) -> Vec<String> {
    let joints = |unit: &'static str| joint_names().map(|joint| format!("{joint}_{unit}"));
    let pose = |of: &'static str| POSE.map(|part| format!("{of}_{part}"));
    let mut names = joints("rad").to_vec();
    if assistance == Assistance::Full {
        names.extend(joints("rad_s"));
        names.extend(joints("n_m"));
    }
    names.extend(pose("left_wrist"));
    names.extend(pose("right_wrist"));
    if assistance == Assistance::Full {
        names.extend(["x", "y", "z"].map(|axis| format!("gravity_{axis}")));
        names.extend(pose("pelvis_in_start"));
    }
    names.extend(BASE_COLUMNS.map(String::from));
    if assistance == Assistance::Full {
        names.push("fallen".into());
    }
    names
}

/// Appends a robot's sensed state to `row`, as far as the assistance includes it.
pub fn state_row(robot: &RobotStep, assistance: Assistance, row: &mut Vec<f32>) {
    let RobotStep { sensed, truth, command, .. } = robot;
    row.extend(sensed.joints.q_rad);
    if assistance == Assistance::Full {
        row.extend(sensed.joints.qd_rad_s);
        row.extend(sensed.joints.torque_n_m);
    }
    row.extend(pose_row(&sensed.pelvis_from_wrist.left));
    row.extend(pose_row(&sensed.pelvis_from_wrist.right));
    if assistance == Assistance::Full {
        row.extend(vector_row(sensed.gravity_in_pelvis));
        row.extend(pose_row(&sensed.start_from_pelvis));
    }
    row.extend(base_row(command));
    if assistance == Assistance::Full {
        row.push(f32::from(u8::from(truth.fallen)));
    }
}

/// Returns a pose as position x, y, z in m and quaternion w, x, y, z.
pub fn pose_row(pose: &Pose) -> [f32; 7] {
    let (t, r) = (pose.translation, pose.rotation);
    [t.x, t.y, t.z, r.w, r.x, r.y, r.z]
}

pub fn vector_row(vector: Vector) -> [f32; 3] {
    [vector.x, vector.y, vector.z]
}

/// Returns a command as a row of `send_joint_chunk`.
pub fn action_row(command: &RobotCommand) -> impl Iterator<Item = f32> {
    command.upper_rad.into_iter().chain(base_row(command))
}

fn base_row(command: &RobotCommand) -> [f32; 4] {
    let base = &command.base;
    [base.vx_m_s, base.vy_m_s, base.yaw_rate_rad_s, base.pelvis_height_m]
}

/// Returns the names of the columns of an action row.
#[pyfunction]
pub fn action_columns() -> Vec<String> {
    let names = joint_names();
    let joints = UPPER.iter().map(|joint| format!("{}_rad", names[*joint]));
    joints.chain(BASE_COLUMNS.map(String::from)).collect()
}

/// Returns the names of the columns of a row of motor setpoints.
#[pyfunction]
pub fn setpoint_columns() -> Vec<String> {
    let names = joint_names();
    let of_block = |block: &'static str| names.iter().map(move |joint| format!("{joint}.{block}"));
    DRIVE_BLOCKS.into_iter().flat_map(of_block).collect()
}

/// Returns the names of the columns of a full state.
#[pyfunction]
pub fn state_columns() -> Vec<String> {
    state_names(Assistance::Full)
}

/// Creates an array of this shape from the numbers. They are copied once.
pub fn shaped<'py, T: Element, const N: usize>(
    py: Python<'py>,
    numbers: &[T],
    shape: [usize; N],
) -> PyResult<Bound<'py, PyArray<T, Dim<[usize; N]>>>>
where
    [usize; N]: IntoDimension<Dim = Dim<[usize; N]>>,
    Dim<[usize; N]>: Dimension,
{
    PyArray1::from_slice(py, numbers).reshape(shape)
}
