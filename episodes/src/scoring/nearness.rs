//! Nearness of a phase, from 0 to 1, the basis of dense rewards for learners. Each of its parts is 1 if the
//! phase's condition on that part holds, and grows towards 1 before. It affects neither results nor phases.

use tandem_sim::{Pose, Side, Vector};

use super::placement::{RELEASE_S, STILL_M_S, STILL_RAD_S, UPRIGHT_RAD};
use super::{Facts, Grip};

/// Distance of a hand from an object beyond which it has not begun to approach.
const FAR_M: f32 = 1.5;
/// Tilt beyond which an object has fallen over.
const FALLEN_OVER_RAD: f32 = 1.0;
/// Middle of a hand's grasp in the frame of the wrist, ahead and inward. It is in front of the palm, which
/// faces left on the right hand.
const GRASP_IN_WRIST_M: [f32; 2] = [0.12, 0.055];
/// Nearness of a hand that touches an object; a hand that holds it has 1.
const TOUCHING: f32 = 0.75;

/// Returns the mean of the parts of a condition.
pub fn all(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

/// Returns 1 if the condition holds, and 0 otherwise.
pub fn is(condition: bool) -> f32 {
    f32::from(u8::from(condition))
}

/// Returns the fraction of the way from `from_value` to `to_value` that `value` has covered.
pub fn come(value: f32, from_value: f32, to_value: f32) -> f32 {
    ((value - from_value) / (to_value - from_value)).clamp(0.0, 1.0)
}

/// Returns the nearness of a hand to holding `object`, from 0 to 1. The first half is the approach to the box
/// around the object.
pub fn grip(f: &Facts, robot: usize, side: Side, object: &str) -> f32 {
    match f.object(object).hands[robot][side] {
        Grip::Holding => 1.0,
        Grip::Touching => TOUCHING,
        Grip::Off => 0.5 * come(from_hand_m(f, robot, side, object), FAR_M, 0.0),
    }
}

/// Returns the nearness of these robots to holding `object`, each by its nearer hand.
pub fn grips(f: &Facts, robots: &[usize], object: &str) -> f32 {
    let nearer =
        |robot: &usize| Side::BOTH.map(|side| grip(f, *robot, side, object)).into_iter().fold(0.0, f32::max);
    all(&robots.iter().map(nearer).collect::<Vec<_>>())
}

/// Returns a measure of how close `object` is to standing upright and still, with no robot touching it.
pub fn standing(f: &Facts, object: &str) -> f32 {
    let is_still = f.speed_m_s(object) <= STILL_M_S && f.turn_rate_rad_s(object) <= STILL_RAD_S;
    let released = f.untouched_s(object) >= RELEASE_S;
    all(&[come(f.tilt_rad(object), FALLEN_OVER_RAD, UPRIGHT_RAD), is(is_still), is(released)])
}

/// Returns the distance from the middle of a hand's grasp to the box around `object`.
fn from_hand_m(f: &Facts, robot: usize, side: Side, object: &str) -> f32 {
    let [ahead_m, inward_m] = GRASP_IN_WRIST_M;
    let inward_m = match side {
        Side::Left => -inward_m,
        Side::Right => inward_m,
    };
    let robot = &f.robots[robot];
    let world_from_wrist = robot.pelvis_in_world * robot.wrist_in_pelvis[side];
    let object = f.object(object);
    let hand_m = object.pose_in_world.inverse() * (world_from_wrist * Vector::new(ahead_m, inward_m, 0.0));
    let reach_m = |direction: Vector| object.model.reach_m(&Pose::IDENTITY, direction);
    let beyond_m = |axis: Vector| {
        let along_m = hand_m.dot(axis);
        (along_m - reach_m(axis)).max(-along_m - reach_m(-axis)).max(0.0)
    };
    Vector::new(beyond_m(Vector::X), beyond_m(Vector::Y), beyond_m(Vector::Z)).length()
}

#[cfg(test)]
mod tests {
    use tandem_sim::Side::{Left, Right};

    use super::*;
    use crate::scoring::{A, B};
    use crate::tasks;

    #[test]
    fn a_hand_comes_nearer_touches_and_holds() {
        let rest = Facts::at_rest(&tasks::find("handover").unwrap());
        // The bottle is 7 cm thick and stands at x = 0.30 m, y = -0.07 m; wrists are in the pelvis.
        let pelvis = rest.robots[A].pelvis_in_world.translation;
        let apart = Vector::new(0.30 - 0.035 - 0.12, -0.07 + 0.035 - 0.055, 0.0);
        let apart = Vector::new(apart.x, apart.y.min(0.0), (0.8 - pelvis.z).max(0.0));
        assert!((from_hand_m(&rest, A, Right, "bottle") - apart.length()).abs() < 1e-3);
        let far = grip(&rest, A, Right, "bottle");
        assert!(far > 0.25 && far < 0.5, "{far}");
        let touched = rest.clone().grip(A, Right, "bottle", Grip::Touching);
        let held = rest.clone().grip(A, Right, "bottle", Grip::Holding);
        assert_eq!(grip(&touched, A, Right, "bottle"), TOUCHING);
        assert_eq!((grip(&held, A, Right, "bottle"), grip(&held, A, Left, "bottle") < 0.5), (1.0, true));
        assert_eq!(grips(&held, &[A], "bottle"), 1.0);
        assert!(grips(&held, &[A, B], "bottle") < 0.75);
    }

    #[test]
    fn what_is_lifted_counts_in_hands_that_hold_it() {
        let handover = tasks::find("handover").unwrap();
        let nearness = |f: &Facts| (handover.phases[0].nearness)(f);
        let touched = Facts::at_rest(&handover).grip(A, Right, "bottle", Grip::Touching);
        let mut knocked = touched.clone();
        knocked.object_mut("bottle").pose_in_world.translation.z += 0.02;
        assert_eq!(nearness(&knocked), nearness(&touched));
        assert!(nearness(&knocked.grip(A, Right, "bottle", Grip::Holding)) > 0.8);
    }

    #[test]
    fn parts_grow_up_to_the_condition_and_no_further() {
        for (value, expected) in [(-1.0, 0.0), (0.0, 0.0), (0.015, 0.5), (0.03, 1.0), (1.0, 1.0)] {
            assert!((come(value, 0.0, 0.03) - expected).abs() < 1e-6, "{value}");
        }
        let rest = Facts::at_rest(&tasks::find("handover").unwrap());
        assert_eq!(standing(&rest, "bottle"), 1.0);
        let leaning = rest.turned("bottle", Vector::X, 0.6);
        assert!((0.6..0.95).contains(&standing(&leaning, "bottle")));
    }

    #[test]
    fn every_phase_says_how_near_it_is() {
        for task in tasks::cohub() {
            let rest = Facts::at_rest(task);
            for phase in task.phases.iter() {
                let nearness = (phase.nearness)(&rest);
                assert!((0.0..1.0).contains(&nearness), "{} {}: {nearness}", task.id, phase.id);
            }
        }
    }
}
