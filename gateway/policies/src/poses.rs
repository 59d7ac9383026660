//! Poses in the formats that policies use: a position, and a rotation in one of several forms.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Length below which a vector has no usable direction.
const SHORTEST: f64 = 1e-6;

/// Number of values in a pose: x, y, z in m, then the rotation in each form of [`RotationForm::ALL`].
pub const POSE_LEN: usize = 3 + 4 + 4 + 6 + 6;

/// Representation of a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RotationForm {
    /// Order w, x, y, z.
    QuaternionWxyz,
    /// Order x, y, z, w.
    QuaternionXyzw,
    /// The first two columns of the matrix, as in Zhou et al. 2019, "On the Continuity of Rotation
    /// Representations".
    Columns,
    /// The first two rows of the matrix, like `matrix_to_rotation_6d` of PyTorch3D.
    Rows,
}

impl RotationForm {
    pub const ALL: [RotationForm; 4] = [
        RotationForm::QuaternionWxyz,
        RotationForm::QuaternionXyzw,
        RotationForm::Columns,
        RotationForm::Rows,
    ];

    /// Returns the number of values.
    pub fn len(self) -> usize {
        match self {
            RotationForm::QuaternionWxyz | RotationForm::QuaternionXyzw => 4,
            RotationForm::Columns | RotationForm::Rows => 6,
        }
    }

    /// Writes the rotation in this form.
    fn write(self, rotation: &UnitQuaternion<f64>) -> Vec<f64> {
        let q = rotation.quaternion();
        let matrix = rotation.to_rotation_matrix();
        match self {
            RotationForm::QuaternionWxyz => vec![q.w, q.i, q.j, q.k],
            RotationForm::QuaternionXyzw => vec![q.i, q.j, q.k, q.w],
            // Matrices are stored column by column.
            RotationForm::Columns => matrix.matrix().iter().take(6).copied().collect(),
            RotationForm::Rows => matrix.matrix().transpose().iter().take(6).copied().collect(),
        }
    }

    /// Returns the rotation nearest to the values, or `None` if they define no direction.
    pub fn read(self, values: &[f64]) -> Option<UnitQuaternion<f64>> {
        match (self, values) {
            (RotationForm::QuaternionWxyz, &[w, x, y, z]) | (RotationForm::QuaternionXyzw, &[x, y, z, w]) => {
                UnitQuaternion::try_new(Quaternion::new(w, x, y, z), SHORTEST)
            }
            (RotationForm::Columns, six) => matrix_of(six),
            (RotationForm::Rows, six) => matrix_of(six).map(|rotation| rotation.inverse()),
            (RotationForm::QuaternionWxyz | RotationForm::QuaternionXyzw, _) => None,
        }
    }
}

/// Returns the rotation from two vectors by Gram-Schmidt orthogonalization. The first axis has the first
/// vector's direction. The second axis is the part of the second vector orthogonal to it. The third axis
/// follows.
fn matrix_of(values: &[f64]) -> Option<UnitQuaternion<f64>> {
    let &[x0, x1, x2, y0, y1, y2] = values else { return None };
    let x = Vector3::new(x0, x1, x2).try_normalize(SHORTEST)?;
    let y = Vector3::new(y0, y1, y2);
    let y = (y - x * x.dot(&y)).try_normalize(SHORTEST)?;
    let matrix = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix)))
}

/// Returns the [`POSE_LEN`] values of a pose, with its rotation in all forms.
pub fn pose_values(position_m: [f64; 3], quaternion_wxyz: [f64; 4]) -> Vec<f64> {
    let rotation = RotationForm::QuaternionWxyz.read(&quaternion_wxyz).unwrap_or_default();
    let [_, derived @ ..] = RotationForm::ALL;
    let derived = derived.iter().flat_map(|form| form.write(&rotation));
    position_m.into_iter().chain(quaternion_wxyz).chain(derived).collect()
}

/// Returns the pose from values that begin with position x, y, z and quaternion w, x, y, z. A zero quaternion
/// means no rotation.
pub fn pose_of(values: &[f64]) -> Isometry3<f64> {
    let rotation = RotationForm::QuaternionWxyz.read(&values[3..7]).unwrap_or_default();
    Isometry3::from_parts(Translation3::new(values[0], values[1], values[2]), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_is_read_as_it_is_written() {
        let rotation = UnitQuaternion::from_euler_angles(0.4, -0.9, 2.1);
        for form in RotationForm::ALL {
            let written = form.write(&rotation);
            assert_eq!(written.len(), form.len());
            assert!(form.read(&written).unwrap().angle_to(&rotation) < 1e-9, "{form:?}");
            // Networks return neither unit quaternions nor orthogonal axes.
            let stretched: Vec<f64> = written.iter().map(|value| value * 1.7).collect();
            assert!(form.read(&stretched).unwrap().angle_to(&rotation) < 1e-9, "{form:?}");
            assert_eq!(form.read(&vec![0.0; form.len()]), None);
        }
        let q = rotation.quaternion();
        let values = pose_values([1.0, 2.0, 3.0], [q.w, q.i, q.j, q.k]);
        assert_eq!(values.len(), POSE_LEN);
        let pose = pose_of(&values);
        assert!(pose.rotation.angle_to(&rotation) < 1e-9 && pose.translation.vector.y == 2.0);
    }

    /// A quarter turn about z rotates x to y and y to -x.
    #[test]
    fn six_numbers_are_columns_or_rows() {
        let quarter = UnitQuaternion::from_scaled_axis(Vector3::z() * std::f64::consts::FRAC_PI_2);
        let rounded = |form: RotationForm| -> Vec<f64> {
            form.write(&quarter).into_iter().map(|value| value.round() + 0.0).collect()
        };
        assert_eq!(rounded(RotationForm::Columns), [0.0, 1.0, 0.0, -1.0, 0.0, 0.0]);
        assert_eq!(rounded(RotationForm::Rows), [0.0, -1.0, 0.0, 1.0, 0.0, 0.0]);
        // The part of the second vector along the first is ignored.
        let leaning = RotationForm::Columns.read(&[0.0, 2.0, 0.0, -1.0, 5.0, 0.0]).unwrap();
        assert!(leaning.angle_to(&quarter) < 1e-9);
        assert_eq!(RotationForm::Columns.read(&[0.0, 2.0, 0.0, 0.0, 5.0, 0.0]), None);
        assert_eq!(pose_of(&[1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0]), Isometry3::translation(1.0, 2.0, 3.0));
    }
}
