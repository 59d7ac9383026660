//! Who holds what, by contact alone: a hand holds an object while its thumb presses against its fingers or its palm.

use serde::{Deserialize, Serialize};
use tandem_sim::{HandContacts, Side, Sides, Step, Vector};

use super::Grip;

/// Each of two opposed parts of a hand must press at least this hard for a hold to begin. A 0.5 kg bottle held at
/// friction 0.8 needs 3 N from either side, a resting finger presses less than half a newton.
pub const HOLD_BEGINS_N: f32 = 1.5;
/// A hold ends when the pressure falls below this; lower than the above, so that a hand in motion does not flicker.
pub const HOLD_ENDS_N: f32 = 0.5;
/// Presses count as opposed if the angle between them is at least 120 degrees.
const OPPOSED_COSINE: f32 = -0.5;
/// For how many control steps in a row the evidence must last before a hold begins or ends: 60 ms.
pub const STEPS_TO_CHANGE: u32 = 3;

/// The detector of one hand and one object.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct GraspDetector {
    holding: bool,
    touching: bool,
    /// Control steps in a row that spoke for the opposite of `holding`.
    steps_against: u32,
}

impl GraspDetector {
    /// Looks at the contacts of one control step.
    pub fn update(&mut self, contacts: &HandContacts) {
        let threshold_n = if self.holding { HOLD_ENDS_N } else { HOLD_BEGINS_N };
        let pressed = opposed_press_n(contacts) >= threshold_n;
        self.steps_against = if pressed == self.holding { 0 } else { self.steps_against + 1 };
        if self.steps_against == STEPS_TO_CHANGE {
            self.holding = pressed;
            self.steps_against = 0;
        }
        let parts = [contacts.thumb_n, contacts.fingers_n, contacts.palm_n];
        self.touching = parts.iter().any(|force_n| *force_n != Vector::ZERO);
    }

    pub fn grip(&self) -> Grip {
        match (self.holding, self.touching) {
            (true, _) => Grip::Holding,
            (false, true) => Grip::Touching,
            (false, false) => Grip::Off,
        }
    }
}

/// The smaller of two opposed presses, thumb against fingers or thumb against palm; 0 where nothing is opposed.
fn opposed_press_n(contacts: &HandContacts) -> f32 {
    let opposed = |other: Vector| {
        let (thumb_n, other_n) = (contacts.thumb_n.length(), other.length());
        let cosine = contacts.thumb_n.dot(other) / (thumb_n * other_n).max(f32::MIN_POSITIVE);
        if cosine <= OPPOSED_COSINE { thumb_n.min(other_n) } else { 0.0 }
    };
    opposed(contacts.fingers_n).max(opposed(contacts.palm_n))
}

/// All hands on one object.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ObjectGrasps {
    object: String,
    /// By robot.
    detectors: Vec<Sides<GraspDetector>>,
    /// Control steps since a hand last touched the object.
    untouched_steps: u32,
}

impl ObjectGrasps {
    pub fn new(object: &str, robots: usize) -> ObjectGrasps {
        ObjectGrasps {
            object: object.into(),
            detectors: vec![Default::default(); robots],
            untouched_steps: 0,
        }
    }

    /// Looks at the touches of one control step.
    pub fn update(&mut self, step: &Step) {
        for (robot, hands) in self.detectors.iter_mut().enumerate() {
            for side in Side::BOTH {
                hands[side].update(&step.contacts(robot, side, &self.object));
            }
        }
        let off = self.grips().iter().all(|hands| *hands == Sides::both(Grip::Off));
        self.untouched_steps = if off { self.untouched_steps + 1 } else { 0 };
    }

    pub fn grips(&self) -> Vec<Sides<Grip>> {
        self.detectors.iter().map(|hands| hands.map(|hand| hand.grip())).collect()
    }

    pub fn untouched_s(&self) -> f64 {
        f64::from(self.untouched_steps) / tandem_sim::CONTROL_HZ
    }
}

#[cfg(test)]
mod tests;
