//! A model at one set of joint coordinates: poses, Jacobians, centre of mass. Nothing allocates after
//! construction.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::parts::{FrameId, Joint, JointKind};
use super::tree::Model;
use crate::error::IkError;

/// Joint coordinates with the resulting poses.
#[derive(Clone, Debug)]
pub struct Configuration<'m> {
    model: &'m Model,
    q: Vec<f64>,
    root_from_joint: Vec<Isometry3<f64>>,
}

impl<'m> Configuration<'m> {
    /// Creates a configuration of the model at coordinates `q` (rad or m, model order).
    ///
    /// # Errors
    ///
    /// Returns an error if `q` has the wrong length or a coordinate is not finite.
    pub fn new(model: &'m Model, q: &[f64]) -> Result<Configuration<'m>, IkError> {
        let mut configuration = Configuration {
            model,
            q: vec![0.0; model.nv()],
            root_from_joint: vec![Isometry3::identity(); model.nv()],
        };
        configuration.set(q)?;
        Ok(configuration)
    }

    /// Changes the coordinates.
    ///
    /// # Errors
    ///
    /// Returns an error if `q` has the wrong length or a coordinate is not finite.
    pub fn set(&mut self, q: &[f64]) -> Result<(), IkError> {
        if q.len() != self.model.nv() {
            return Err(IkError::WrongLength { got: q.len(), expected: self.model.nv() });
        }
        if q.iter().any(|value| !value.is_finite()) {
            return Err(IkError::NotFinite { what: "a joint coordinate" });
        }
        self.q.copy_from_slice(q);
        self.update();
        Ok(())
    }

    /// Moves each joint to a finite coordinate.
    pub(crate) fn place(&mut self, mut coordinate: impl FnMut(&Joint) -> f64) {
        for (q, joint) in self.q.iter_mut().zip(&self.model.joints) {
            *q = coordinate(joint);
        }
        self.update();
    }

    /// Adds `scale` times `dq` to the coordinates.
    pub(crate) fn advance(&mut self, dq: &[f64], scale: f64) {
        for (q, dq) in self.q.iter_mut().zip(dq) {
            *q += scale * dq;
        }
        self.update();
    }

    fn update(&mut self) {
        for (index, joint) in self.model.joints.iter().enumerate() {
            let local = joint.parent_from_joint * joint.motion(self.q[index]);
            self.root_from_joint[index] = match joint.parent {
                Some(parent) => self.root_from_joint[parent] * local,
                None => local,
            };
        }
    }

    /// Returns the model.
    pub fn model(&self) -> &'m Model {
        self.model
    }

    /// Returns the coordinates, rad or m.
    pub fn q(&self) -> &[f64] {
        &self.q
    }

    /// Returns the pose of a frame in the root's frame.
    pub fn root_from_frame(&self, frame: FrameId) -> Isometry3<f64> {
        let frame = &self.model.frames[frame.0];
        frame.joint.map_or(Isometry3::identity(), |joint| self.root_from_joint[joint])
            * frame.joint_from_frame
    }

    /// Returns the velocity (m/s, rad/s) of a frame's origin and the frame's angular velocity per unit
    /// speed of one joint that supports it. Both are expressed in the frame itself: one column of the
    /// body Jacobian.
    pub(crate) fn body_jacobian_column(
        &self,
        root_from_frame: &Isometry3<f64>,
        joint: usize,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (linear, angular) = self.velocity_of_point(&root_from_frame.translation.vector, joint);
        let frame_from_root = root_from_frame.rotation.inverse();
        (frame_from_root * linear, frame_from_root * angular)
    }

    /// Computes the body Jacobian of a frame, 6 x nv, [m; rad] per rad or m, written to `columns`.
    pub fn frame_jacobian(&self, frame: FrameId, columns: &mut [Vector6<f64>]) {
        columns.fill(Vector6::zeros());
        let root_from_frame = self.root_from_frame(frame);
        for &joint in self.model.support(frame) {
            let (linear, angular) = self.body_jacobian_column(&root_from_frame, joint);
            columns[joint].fixed_rows_mut::<3>(0).copy_from(&linear);
            columns[joint].fixed_rows_mut::<3>(3).copy_from(&angular);
        }
    }

    /// Returns the velocity of a point (root frame) that moves with the tip of `joint`, and the angular
    /// velocity, per unit joint speed.
    pub(crate) fn velocity_of_point(
        &self,
        point: &Vector3<f64>,
        joint: usize,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let pose = &self.root_from_joint[joint];
        let axis = pose.rotation * self.model.joints[joint].axis.into_inner();
        match self.model.joints[joint].kind {
            JointKind::Hinge => (axis.cross(&(point - pose.translation.vector)), axis),
            JointKind::Slide => (axis, Vector3::zeros()),
        }
    }

    /// Returns the centre of mass in the root's frame, m; the root's origin for a model without mass.
    pub fn center_of_mass(&self) -> Vector3<f64> {
        let mut moment = Vector3::zeros();
        let mut mass_kg = 0.0;
        for (index, mass) in self.model.masses.iter().enumerate() {
            let pose = self.root_from_joint.get(index).copied().unwrap_or_else(Isometry3::identity);
            moment += pose.rotation * mass.moment_kg_m + pose.translation.vector * mass.mass_kg;
            mass_kg += mass.mass_kg;
        }
        if mass_kg > 0.0 { moment / mass_kg } else { Vector3::zeros() }
    }

    /// Computes the columns of the centre of mass Jacobian, 3 x nv, m per rad or per m, written to `columns`.
    pub fn center_of_mass_jacobian(&self, columns: &mut [Vector3<f64>]) {
        columns.fill(Vector3::zeros());
        let total_kg: f64 = self.model.masses.iter().map(|mass| mass.mass_kg).sum();
        if total_kg <= 0.0 {
            return;
        }
        for (index, support) in self.model.supports.iter().enumerate() {
            let mass = &self.model.masses[index];
            if mass.mass_kg <= 0.0 {
                continue;
            }
            let centre =
                self.root_from_joint[index] * nalgebra::Point3::from(mass.moment_kg_m / mass.mass_kg);
            for &joint in support {
                columns[joint] += self.velocity_of_point(&centre.coords, joint).0 * (mass.mass_kg / total_kg);
            }
        }
    }
}
