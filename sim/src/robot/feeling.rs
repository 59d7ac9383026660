//! What a robot's hands feel: the force on each, and the weight that each carries. Both are read from the arms' own joint
//! torques, as far as gravity does not explain them.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

use super::arm::Arm;
use super::hand_force::HandForce;
use super::payload::Payload;
use crate::Sides;
use crate::body::{ARMS, JOINTS, WholeBody};

#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct Feeling {
    payload: Sides<Payload>,
    force: Sides<HandForce>,
}

impl Feeling {
    /// One physics step: `torque_n_m` are the drives' torques of the last step. Returns the torques that hold all joints
    /// against gravity and the arms against the weights in the hands.
    pub(super) fn update(&mut self, body: &WholeBody, torque_n_m: &[f32], dt_s: f32) -> [f32; JOINTS] {
        let gravity_n_m = body.gravity_torques_n_m();
        let mut load_n_m = gravity_n_m;
        let palms_m = body.palms_m();
        for (side, first) in ARMS.by_side() {
            let arm = Arm {
                levers_m: [Vector::X, Vector::Y, Vector::Z].map(|direction| {
                    std::array::from_fn(|i| body.moment_n_m(first + i, palms_m[side], direction))
                }),
                excess_n_m: std::array::from_fn(|i| torque_n_m[first + i] - gravity_n_m[first + i]),
            };
            self.force[side].update(&arm, dt_s);
            self.payload[side].update(&arm, dt_s);
            for (i, held_n_m) in self.payload[side].torques_n_m(&arm).into_iter().enumerate() {
                load_n_m[first + i] += held_n_m;
            }
        }
        load_n_m
    }

    /// World frame.
    pub(super) fn force_n(&self) -> Sides<Vector> {
        self.force.each_ref().map(HandForce::force_n)
    }

    pub(super) fn weight_n(&self) -> Sides<f32> {
        self.payload.each_ref().map(Payload::weight_n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::ARM_JOINTS;
    use crate::body::posed::{Posed, model};
    use crate::{PHYSICS_DT_S, Side};

    /// Arms bent in front of the body.
    fn holding() -> WholeBody<'static> {
        let mut posed = Posed::standing();
        for (side, first) in ARMS.by_side() {
            let bent_rad = [-0.4, 0.2 * side.sign(), 0.1 * side.sign(), 0.6, 0.0, 0.2, 0.0];
            posed.q_rad[first..first + ARM_JOINTS].copy_from_slice(&bent_rad);
        }
        posed.body()
    }

    /// Feels long enough for the filters, with torques that hold the arms against gravity and a force on each palm.
    fn feel(body: &WholeBody, force_n: Sides<Vector>) -> (Feeling, [f32; JOINTS]) {
        let mut torque_n_m = body.gravity_torques_n_m();
        for (side, first) in ARMS.by_side() {
            let (palm_m, force_n) = (body.palms_m()[side], force_n[side]);
            for (joint, torque_n_m) in torque_n_m.iter_mut().enumerate().skip(first).take(ARM_JOINTS) {
                *torque_n_m -= body.moment_n_m(joint, palm_m, force_n);
            }
        }
        let mut feeling = Feeling::default();
        let mut load_n_m = [0.0; JOINTS];
        for _ in 0..400 {
            load_n_m = feeling.update(body, &torque_n_m, PHYSICS_DT_S);
        }
        (feeling, load_n_m)
    }

    #[test]
    fn a_weight_in_a_hand_is_recovered_and_held() {
        let body = holding();
        let weight_n = 12.0;
        let force_n = Sides { left: Vector::ZERO, right: Vector::Z * -weight_n };
        let (feeling, load_n_m) = feel(&body, force_n);
        let found_n = feeling.weight_n();
        assert!((found_n.right - weight_n).abs() < 1e-2 && found_n.left.abs() < 1e-3, "{found_n:?}");
        // Most of it is fed forward, on top of gravity.
        let gravity_n_m = body.gravity_torques_n_m();
        for joint in 0..JOINTS {
            let held = (ARMS.right..ARMS.right + ARM_JOINTS).contains(&joint);
            let lever_m = body.moment_n_m(joint, body.palms_m().right, Vector::Z);
            let extra_n_m = if held { 0.85 * weight_n * lever_m } else { 0.0 };
            assert!(
                (load_n_m[joint] - gravity_n_m[joint] - extra_n_m).abs() < 1e-2,
                "{}",
                model().joints[joint].name
            );
        }
    }

    #[test]
    fn a_force_on_a_hand_is_recovered_in_every_direction() {
        // But for the damping, which costs most along the arm.
        let body = holding();
        for force_n in
            [Vector::new(0.0, 0.0, -12.0), Vector::new(10.0, 0.0, 0.0), Vector::new(-3.0, 8.0, 5.0)]
        {
            let (feeling, _) = feel(&body, Sides { left: force_n, right: -force_n });
            for (side, expected_n) in (Sides { left: force_n, right: -force_n }).by_side() {
                let found_n = feeling.force_n()[side];
                let error_n = (found_n - expected_n).length();
                assert!(error_n < 0.25 * expected_n.length(), "{side:?}: {found_n}, not {expected_n}");
            }
        }
    }

    /// Neither a table under the hand nor a pull to the side is something that it carries.
    #[test]
    fn only_weights_are_carried() {
        for force_n in [Vector::Z * 15.0, Vector::Y * 15.0] {
            let (feeling, _) = feel(&holding(), Sides::both(force_n));
            assert_eq!(feeling.weight_n(), Sides::both(0.0), "under {force_n}");
        }
        let (feeling, _) = feel(&holding(), Sides::both(Vector::Z * -300.0));
        assert!(feeling.weight_n()[Side::Left] < 35.1 && feeling.force_n().left.length() < 80.1, "an impact");
    }
}
