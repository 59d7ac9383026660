//! Conversion of wrist poses from a policy's frame to the frame in which they are executed.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use tandem_episodes::rows::velocities;
use tandem_tools_spec::WristMove;

use super::ActionRow;
use crate::{
    columns::{WRISTS, hand, wrist_position, wrist_rotation},
    map::WristFrame,
    poses::RotationForm,
};

/// Target of a wrist: position, rotation, both or neither.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WristTarget {
    pub position_m: Option<Vector3<f64>>,
    pub rotation: Option<UnitQuaternion<f64>>,
}

impl WristTarget {
    /// Reads the target of a wrist from `told_values`, if the policy commands it according to `told_columns`.
    pub fn read(told_values: &[f64], told_columns: &[usize], side: usize) -> Result<WristTarget, String> {
        let position = wrist_position(side);
        let position_m = told_columns
            .contains(&position.start)
            .then(|| Vector3::from_column_slice(&told_values[position]));
        let form = RotationForm::ALL
            .into_iter()
            .find(|form| told_columns.contains(&wrist_rotation(side, *form).start));
        let rotation = form.map(|form| {
            let values = &told_values[wrist_rotation(side, form)];
            form.read(values).ok_or_else(|| {
                format!("the rotation of {} has no direction: {values:?}; expected a rotation", WRISTS[side])
            })
        });
        Ok(WristTarget { position_m, rotation: rotation.transpose()? })
    }

    /// Converts the target to its execution frame. This is the start frame if hands stay fixed in the world,
    /// otherwise the pelvis frame.
    pub fn resolved(
        self,
        frame: WristFrame,
        is_delta: bool,
        pelvis_from_wrist: &Isometry3<f64>,
        start_from_pelvis: &Isometry3<f64>,
    ) -> WristTarget {
        let start_from_wrist = start_from_pelvis * pelvis_from_wrist;
        match (frame, is_delta) {
            (WristFrame::Pelvis | WristFrame::Start, false) => self,
            (WristFrame::Pelvis, true) => self.beside(pelvis_from_wrist),
            (WristFrame::Start, true) => self.beside(&start_from_wrist),
            (WristFrame::Wrist, _) => self.moved(&start_from_wrist),
        }
    }

    /// Adds this difference to `pose`, along and about the axes of the frame in which `pose` is expressed.
    fn beside(self, pose: &Isometry3<f64>) -> WristTarget {
        WristTarget {
            position_m: self.position_m.map(|step_m| pose.translation.vector + step_m),
            rotation: self.rotation.map(|turn| turn * pose.rotation),
        }
    }

    /// Transforms the target from the frame whose pose is `pose` to the frame in which `pose` is expressed.
    fn moved(self, pose: &Isometry3<f64>) -> WristTarget {
        WristTarget {
            position_m: self.position_m.map(|position_m| (pose * Point3::from(position_m)).coords),
            rotation: self.rotation.map(|rotation| pose.rotation * rotation),
        }
    }
}

/// Returns the `move_wrists` entry for a robot whose pelvis is at `start_from_pelvis`. Only the hand columns
/// in `told_columns` are used.
pub fn wrist_move(
    robot: &str,
    told: &ActionRow,
    told_columns: &[usize],
    frame: WristFrame,
    start_from_pelvis: &Isometry3<f64>,
) -> WristMove {
    let carried = frame == WristFrame::Pelvis;
    let pelvis_from_start = start_from_pelvis.inverse();
    let [left, right] = told.wrists.map(|wrist| match carried {
        true => wrist,
        false => wrist.moved(&pelvis_from_start),
    });
    let position_m = |wrist: WristTarget| wrist.position_m.map(<[f64; 3]>::from);
    let quaternion_wxyz = |wrist: WristTarget| {
        let quaternion = wrist.rotation.map(|rotation| *rotation.quaternion());
        quaternion.map(|q| [q.w, q.i, q.j, q.k])
    };
    let fingers_rad = |side: usize| {
        let is_told = hand(side).any(|column| told_columns.contains(&column));
        is_told.then(|| std::array::from_fn(|finger| told.row[hand(side).start + finger]))
    };
    let [vx, vy, yaw_rate] = [0, 1, 2].map(|index| Some(told.row[velocities().start + index]));
    WristMove {
        left_position_m: position_m(left),
        left_quaternion_wxyz: quaternion_wxyz(left),
        right_position_m: position_m(right),
        right_quaternion_wxyz: quaternion_wxyz(right),
        carried: Some(carried),
        left_fingers_rad: fingers_rad(0),
        right_fingers_rad: fingers_rad(1),
        vx_m_s: vx,
        vy_m_s: vy,
        yaw_rate_rad_s: yaw_rate,
        pelvis_height_m: told.row.last().copied(),
        ..WristMove::hold(robot)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::Translation3;

    use super::*;

    fn quarter(axis: Vector3<f64>) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(axis * FRAC_PI_2)
    }

    /// Returns the poses of a wrist in the pelvis frame and of the pelvis. The pelvis is two metres ahead
    /// and has turned left. The wrist is in front of it, and its fingers point down.
    fn poses() -> (Isometry3<f64>, Isometry3<f64>) {
        let pelvis_from_wrist =
            Isometry3::from_parts(Translation3::new(0.3, 0.2, 0.1), quarter(Vector3::y()));
        let start_from_pelvis =
            Isometry3::from_parts(Translation3::new(2.0, 0.0, 0.8), quarter(Vector3::z()));
        (pelvis_from_wrist, start_from_pelvis)
    }

    /// Returns the wrist target of the command for a displacement of 10 cm along x.
    fn goes(frame: WristFrame, is_delta: bool) -> ([f64; 3], [f64; 4], bool) {
        let (pelvis_from_wrist, start_from_pelvis) = poses();
        let told =
            WristTarget { position_m: Some(Vector3::x() * 0.1), rotation: Some(quarter(Vector3::x())) };
        let target = told.resolved(frame, is_delta, &pelvis_from_wrist, &start_from_pelvis);
        let row =
            ActionRow { row: vec![0.0; 35], wrists: [target, WristTarget::default()], motor_row: Vec::new() };
        let asked = wrist_move("A", &row, &[], frame, &start_from_pelvis);
        let rounded = |value: f64| (value * 1e6).round() / 1e6 + 0.0;
        assert_eq!((asked.right_position_m, asked.left_fingers_rad), (None, None));
        let quaternion_wxyz = asked.left_quaternion_wxyz.unwrap().map(rounded);
        (asked.left_position_m.unwrap().map(rounded), quaternion_wxyz, asked.carried.unwrap())
    }

    #[test]
    fn frames_say_along_which_axes_a_wrist_goes() {
        let turned = |rotation: UnitQuaternion<f64>| {
            let q = rotation.quaternion();
            [q.w, q.i, q.j, q.k].map(|value| (value * 1e6).round() / 1e6 + 0.0)
        };
        let (x, y, z) = (quarter(Vector3::x()), quarter(Vector3::y()), quarter(Vector3::z()));
        assert_eq!(goes(WristFrame::Pelvis, false), ([0.1, 0.0, 0.0], turned(x), true));
        assert_eq!(goes(WristFrame::Pelvis, true), ([0.4, 0.2, 0.1], turned(x * y), true));
        // The robot has turned left, so a point 10 cm ahead of its start is behind its right shoulder.
        assert_eq!(goes(WristFrame::Start, false), ([0.0, 1.9, -0.8], turned(z.inverse() * x), false));
        assert_eq!(goes(WristFrame::Start, true), ([0.3, 0.1, 0.1], turned(z.inverse() * x * z * y), false));
        // The fingers point down, and so does the wrist's x axis.
        assert_eq!(goes(WristFrame::Wrist, true), ([0.3, 0.2, 0.0], turned(y * x), false));
    }

    #[test]
    fn fingers_and_base_go_along() {
        let mut row = vec![0.0; 35];
        (row[14], row[20], row[31], row[34]) = (0.4, -0.5, 0.2, 0.7);
        let row = ActionRow { row, wrists: [WristTarget::default(); 2], motor_row: Vec::new() };
        let asked = wrist_move("B", &row, &[14], WristFrame::Pelvis, &Isometry3::identity());
        let fingers_rad = asked.left_fingers_rad.unwrap();
        assert_eq!((fingers_rad[0], fingers_rad[6], asked.right_fingers_rad), (0.4, -0.5, None));
        assert_eq!((asked.vx_m_s, asked.vy_m_s, asked.pelvis_height_m), (Some(0.2), Some(0.0), Some(0.7)));
        assert_eq!((asked.left_position_m, asked.left_quaternion_wxyz), (None, None));
    }
}
