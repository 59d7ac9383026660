//! Motors and position targets of joints, as plain data.

use mjcf_rs::body::JointType;
use mjcf_rs::extras::{Actuator as Element, ActuatorKind as Kind};

use super::Document;
use crate::SimError;

/// Drives one hinge or slide. Efforts are N m or N, positions rad or m.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    pub joint: String,
    pub kind: ActuatorKind,
    /// What it is told is brought into this range.
    pub control_range: Option<[f64; 2]>,
    pub effort_range: Option<[f64; 2]>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ActuatorKind {
    /// Exerts what it is told.
    Motor,
    /// kp (what it is told - q) - kd q'.
    Position { kp: f64, kd: f64 },
}

impl Document {
    pub fn actuators(&self) -> Result<Vec<Actuator>, SimError> {
        self.model.actuators.iter().map(|element| self.actuator(element)).collect()
    }

    fn actuator(&self, element: &Element) -> Result<Actuator, SimError> {
        let joint = element.joint.clone().unwrap_or_default();
        self.axis_joint(&joint)?;
        if element.gear != [1.0, 0.0, 0.0, 0.0, 0.0, 0.0] {
            let what = format!("actuator of joint `{joint}` has a gear; state gains and ranges of the joint");
            return Err(self.unsupported(what));
        }
        let kind = match element.kind {
            Kind::Motor => ActuatorKind::Motor,
            Kind::Position => {
                ActuatorKind::Position { kp: element.kp.unwrap_or(1.0), kd: element.kv.unwrap_or(0.0) }
            }
            Kind::Velocity | Kind::IntVelocity | Kind::Damper | Kind::General | Kind::Other => {
                let what = format!("actuator {:?} of joint `{joint}`; use motor or position", element.kind);
                return Err(self.unsupported(what));
            }
        };
        let autolimits = self.model.compiler.autolimits;
        let control = element.ctrl_limited.resolve(autolimits, element.ctrl_range.is_some());
        let effort = element.force_limited.resolve(autolimits, element.force_range.is_some());
        Ok(Actuator {
            joint,
            kind,
            control_range: element.ctrl_range.filter(|_| control),
            effort_range: element.force_range.filter(|_| effort),
        })
    }

    /// A hinge or slide by name.
    pub(super) fn axis_joint(&self, name: &str) -> Result<&mjcf_rs::body::Joint, SimError> {
        let axes = || {
            let joints = self.model.bodies.iter().flat_map(|entry| &entry.body.joints);
            joints.filter(|joint| matches!(joint.type_, JointType::Hinge | JointType::Slide))
        };
        axes().find(|joint| joint.name.as_deref() == Some(name)).ok_or_else(|| {
            let have = axes().filter_map(|joint| joint.name.as_deref()).collect::<Vec<_>>().join(", ");
            self.unsupported(format!("no hinge or slide `{name}`; have: {have}"))
        })
    }
}
