//! Grasp detection by contact alone: a hand holds an object while its thumb presses against its fingers or
//! its palm.

use serde::{Deserialize, Serialize};
use tandem_sim::{HandContacts, Side, Sides, Step, Vector};

use super::Grip;

/// Minimum force of each of two opposed parts of a hand for a hold to begin. A 0.5 kg bottle held at friction
/// 0.8 needs 3 N from either side, and a resting finger presses with less than 0.5 N.
pub const HOLD_BEGINS_N: f32 = 1.5;
/// Force below which a hold ends. It is lower than `HOLD_BEGINS_N`, so that a hand in motion does not
/// flicker.
pub const HOLD_ENDS_N: f32 = 0.5;
/// Cosine of the angle, 120 degrees, from which presses count as opposed.
const OPPOSED_COSINE: f32 = -0.5;
/// Number of successive control steps, 60 ms, for which the evidence must last before a hold begins or
/// ends.
pub const STEPS_TO_CHANGE: u32 = 3;

/// The detector of one hand and one object.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct GraspDetector {
    holding: bool,
    touching: bool,
    /// Successive control steps with evidence against `holding`.
    steps_against: u32,
}

impl GraspDetector {
    /// Updates the detector with the contacts of one control step.
    pub fn update(&mut self, contacts: &HandContacts) {
        let threshold_n = if self.holding { HOLD_ENDS_N } else { HOLD_BEGINS_N };
        let pressed = opposed_press_n(contacts) >= threshold_n;
        self.steps_against = if pressed == self.holding { 0 } else { self.steps_against.saturating_add(1) };
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

/// Returns the smaller of two opposed presses, thumb against fingers or thumb against palm; 0 if none are
/// opposed.
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
    /// The detectors of each robot's hands.
    detectors: Vec<Sides<GraspDetector>>,
    /// Control steps since any part of a robot last touched the object, or a hand held it.
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

    /// Returns `true` if another memory belongs to the same object and the same number of robots.
    pub fn is_alike(&self, other: &ObjectGrasps) -> bool {
        self.object == other.object && self.detectors.len() == other.detectors.len()
    }

    /// Updates the detectors with the touches of one control step.
    pub fn update(&mut self, step: &Step) {
        for (robot, hands) in self.detectors.iter_mut().enumerate() {
            for side in Side::BOTH {
                hands[side].update(&step.contacts(robot, side, &self.object));
            }
        }
        // A hand that has lost touch for a moment still holds.
        let hands_off = self.grips().iter().all(|hands| *hands == Sides::both(Grip::Off));
        let off = hands_off && !step.is_touched(&self.object);
        self.untouched_steps = if off { self.untouched_steps.saturating_add(1) } else { 0 };
    }

    pub fn grips(&self) -> Vec<Sides<Grip>> {
        self.detectors.iter().map(|hands| hands.map(|hand| hand.grip())).collect()
    }

    pub fn untouched_s(&self) -> f64 {
        f64::from(self.untouched_steps) / tandem_sim::CONTROL_HZ
    }
}

/// Tests of presses at both sides of every threshold, and of their durations.
#[cfg(test)]
mod tests {
    use tandem_sim::{BodyTouch, ObjectState, ObjectStep, Pose};

    use super::*;

    fn contacts(thumb_n: Vector, fingers_n: Vector, palm_n: Vector) -> HandContacts {
        HandContacts { thumb_n, fingers_n, palm_n }
    }

    /// Returns contacts of thumb and fingers on opposite sides, each pressing with `force_n`.
    fn pinch(force_n: f32) -> HandContacts {
        contacts(Vector::Y * force_n, Vector::Y * -force_n, Vector::ZERO)
    }

    #[test]
    fn only_opposed_presses_hold() {
        let (none, weak, strong) = (Vector::ZERO, HOLD_BEGINS_N - 0.01, HOLD_BEGINS_N + 0.01);
        let tilted = |degrees: f32| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            Vector::new(sine, cosine, 0.0) * strong
        };
        let thumb = Vector::Y * strong;
        for (what, contacts, expected) in [
            ("nothing", contacts(none, none, none), Grip::Off),
            ("thumb alone", contacts(thumb, none, none), Grip::Touching),
            ("fingers and palm", contacts(none, thumb, -thumb), Grip::Touching),
            ("thumb and fingers", pinch(strong), Grip::Holding),
            ("thumb and palm", contacts(thumb, none, -thumb), Grip::Holding),
            ("too weak", pinch(weak), Grip::Touching),
            ("one side too weak", contacts(thumb * 9.0, -Vector::Y * weak, none), Grip::Touching),
            ("same side", contacts(thumb, thumb, none), Grip::Touching),
            ("121 degrees", contacts(thumb, tilted(121.0), none), Grip::Holding),
            ("119 degrees", contacts(thumb, tilted(119.0), none), Grip::Touching),
        ] {
            let mut detector = GraspDetector::default();
            (0..STEPS_TO_CHANGE).for_each(|_| detector.update(&contacts));
            assert_eq!(detector.grip(), expected, "{what}");
        }
    }

    #[test]
    fn an_object_is_untouched_while_no_part_of_a_robot_touches_it() {
        let state = ObjectState {
            world_from_object: Pose::IDENTITY,
            velocity_m_s: Vector::ZERO,
            angular_velocity_rad_s: Vector::ZERO,
        };
        let bottle = ObjectStep { name: "bottle".into(), state };
        let step = |body_touches: Vec<BodyTouch>| Step {
            control_step: 0,
            time_s: 0.0,
            robots: Vec::new(),
            objects: vec![bottle.clone()],
            touches: Vec::new(),
            body_touches,
        };
        let mut grasps = ObjectGrasps::new("bottle", 2);
        (0..10).for_each(|_| grasps.update(&step(Vec::new())));
        assert!((grasps.untouched_s() - 0.2).abs() < 1e-9);
        // Touch by a forearm or a foot, without a hand.
        grasps.update(&step(vec![BodyTouch { object: 0, robot: 1 }]));
        assert_eq!((grasps.untouched_s(), grasps.grips()), (0.0, vec![Sides::both(Grip::Off); 2]));
        grasps.update(&step(Vec::new()));
        assert!((grasps.untouched_s() - 0.02).abs() < 1e-9);
    }

    #[test]
    fn a_hold_takes_60_ms_to_begin_and_to_end_and_does_not_flicker() {
        let between = (HOLD_BEGINS_N + HOLD_ENDS_N) / 2.0;
        let (strong, off) = (HOLD_BEGINS_N + 1.0, 0.0);
        let steps = [
            (strong, false),
            (strong, false),
            (off, false), // starts over
            (strong, false),
            (strong, false),
            (strong, true),
            (between, true), // above the lower threshold
            (off, true),
            (off, true),
            (strong, true), // starts over
            (off, true),
            (off, true),
            (off, false),
            (between, false), // below the upper threshold
            (between, false),
            (between, false),
        ];
        let mut detector = GraspDetector::default();
        for (index, (force_n, holding)) in steps.into_iter().enumerate() {
            detector.update(&pinch(force_n));
            assert_eq!(detector.grip() == Grip::Holding, holding, "step {index}");
        }
    }
}
