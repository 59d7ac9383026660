//! What drives the joints of a file: its actuators, which its keys tell what to do and when.

use super::{Placed, joint_link};
use crate::SimError;
use crate::dynamics::{Drive, Dynamics, LinkId};
use crate::mjcf::{Actuator, ActuatorKind, Document, Key};

/// Actuators do what the key `start` tells them, and from the time of every later key what that one does.
#[derive(Default)]
pub(crate) struct Machinery {
    actuated: Vec<(LinkId, Actuator)>,
    /// Those that tell the actuators something, earliest first.
    keys: Vec<Key>,
}

/// Of the key in which a file begins.
pub(crate) const START: &str = "start";

impl Machinery {
    /// Of a file whose trees were placed.
    pub fn of(document: &Document, placed: &[Placed]) -> Result<Machinery, SimError> {
        let mut actuated: Vec<(LinkId, Actuator)> = Vec::new();
        for actuator in document.actuators()? {
            let Some(link) = joint_link(placed, &actuator.joint) else { continue };
            if actuated.iter().any(|(other, _)| *other == link) {
                let what = format!("joint `{}` has two actuators; put both into one", actuator.joint);
                return Err(document.unsupported(what));
            }
            if actuator.effort_range.is_some_and(|[low, high]| low != -high) {
                let what = format!("the actuator of joint `{}` is stronger one way", actuator.joint);
                return Err(document.unsupported(format!("{what}; use a forcerange of -x x")));
            }
            actuated.push((link, actuator));
        }
        let mut keys = document.keys()?;
        keys.retain(|key| (key.name == START || key.time_s > 0.0) && !key.controls.is_empty());
        keys.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        Ok(Machinery { actuated, keys })
    }

    /// Sets what acts from this time on. An actuator that no key has told anything yet is told 0, as in MuJoCo.
    pub fn drive(&self, dynamics: &mut Dynamics, time_s: f64) {
        let key = self.keys.iter().rev().find(|key| key.time_s <= time_s);
        for (index, (link, actuator)) in self.actuated.iter().enumerate() {
            let command = key.map_or(0.0, |key| key.controls[index]);
            dynamics.tree_mut(link.tree).drive(link.link, drive(actuator, command));
        }
    }
}

fn drive(actuator: &Actuator, command: f64) -> Drive {
    let command = actuator.control_range.map_or(command, |[low, high]| command.clamp(low, high));
    match actuator.kind {
        ActuatorKind::Motor => Drive { feedforward: command, ..Drive::NONE },
        ActuatorKind::Position { kp, kd } => Drive { target: command, kp, kd, ..Drive::NONE },
    }
}
