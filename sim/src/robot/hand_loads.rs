//! Forces on a robot's hands, and the weight that each carries. Both are estimated from the arms' own
//! joint torques, minus the part that gravity explains.
//!
//! Force: external torques tau_ext are J^T f with f the force on the palm, so
//!   f = (J J^T + damping I)^-1 J tau_ext,   J: 3 x 7 [m],
//! low-passed. The external force on a hand uses tau_ext of [`ArmMomentum`], which accounts for the arm's own
//! motion. The load of an arm on the trunk includes the arm's inertia and uses tau_ext = tau_gravity - tau.
//! The balance needs both. A stretched arm cannot sense forces along itself; damping keeps its estimate
//! plausible.
//!
//! Weight: at rest the torque beyond gravity is J^T f with f the load at the palm. Only the vertical
//! part is estimated, as the least squares fit  w = -(J_z . tau) / (J_z . J_z),  low-passed, and never
//! negative: pushing on a table is not a load. The arms' torques that carry it are fed forward.

use rapier3d::math::Vector;
use rapier3d::na::{Cholesky, Const, SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::arm_momentum::{ArmMomentum, OBSERVER_TIME_S};
use crate::Sides;
use crate::body::{ARM_JOINTS, ARMS, BodyEstimate, HAND_JOINTS, HANDS, JOINTS};

#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct HandLoads {
    momentum: Sides<ArmMomentum>,
    payload: Sides<Payload>,
    /// External force on each hand.
    force: Sides<HandForce>,
    /// External force on each hand plus the inertia of the moving arm.
    reaction: Sides<HandForce>,
    grip: Sides<Grip>,
}

/// Measurements of one arm at one instant.
struct Arm {
    /// Torque of each joint per newton at the palm along world x, y, z: the rows of J.
    levers_m: [[f32; ARM_JOINTS]; 3],
    /// Torques of the drives beyond those that hold the arm against gravity.
    excess_n_m: [f32; ARM_JOINTS],
}

/// Filter times: slow compared with the arm's own motion, fast compared with a partner's pull. The external
/// force first passes the observer's filter, and the two filter times add up to the reaction's.
const REACTION_FILTER_TIME_S: f32 = 0.2;
const FORCE_FILTER_TIME_S: f32 = REACTION_FILTER_TIME_S - OBSERVER_TIME_S;
const FORCE_DAMPING_M2: f32 = 0.002;
/// Maximum force: more than an arm can hold is an impact.
const LARGEST_FORCE_N: f32 = 80.0;

/// Filter time: slow compared with the arm's own motion, fast compared with a lift of one second.
const WEIGHT_FILTER_TIME_S: f32 = 0.12;
/// Share of the estimated weight that is fed forward. With a share of 1, two robots that pull on one object
/// would never stop pulling.
const FED_FORWARD_SHARE: f32 = 0.85;
/// Minimum share of the torques that a weight must explain; an arm that presses sideways shows another
/// pattern.
const MIN_EXPLAINED_SHARE: f32 = 0.6;
/// Maximum weight: Dex3-1 hands are not built for heavier loads.
const LARGEST_WEIGHT_N: f32 = 35.0;

/// Number of thumb joints among the seven joints of a hand.
const THUMB_JOINTS: usize = 3;
const GRIP_FILTER_TIME_S: f32 = 0.2;
/// Minimum torque of a pressing finger: more than the weight of fingers, less than a grip's torque. A press
/// continues until the torque is half as large.
const MIN_PRESS_N_M: f32 = 0.2;
const STILL_PRESSES: f32 = 0.5;

impl HandLoads {
    /// Runs one physics step; `torque_n_m` are the drives' torques of the last step. Returns the torques
    /// that hold all joints against gravity and the arms against the weights in the hands.
    pub(super) fn update(&mut self, body: &BodyEstimate, torque_n_m: &[f32], dt_s: f32) -> [f32; JOINTS] {
        let gravity_n_m = body.gravity_torques_n_m();
        let mut load_n_m = gravity_n_m;
        let palms_m = body.palms_m();
        let motions = body.link_motions();
        for (side, first) in ARMS.by_side() {
            let excess_n_m = std::array::from_fn(|i| torque_n_m[first + i] - gravity_n_m[first + i]);
            let outside_n_m = self.momentum[side].update(body, motions, first, &excess_n_m, dt_s);
            let arm = Arm {
                levers_m: [Vector::X, Vector::Y, Vector::Z].map(|direction| {
                    std::array::from_fn(|i| body.moment_n_m(first + i, palms_m[side], direction))
                }),
                excess_n_m,
            };
            let fit = PalmFit::of(&arm.levers_m);
            self.force[side].update(&fit, outside_n_m, FORCE_FILTER_TIME_S, dt_s);
            let felt_n_m = arm.excess_n_m.map(|excess_n_m| -excess_n_m);
            self.reaction[side].update(&fit, felt_n_m, REACTION_FILTER_TIME_S, dt_s);
            self.payload[side].update(&arm, dt_s);
            self.grip[side].update(&torque_n_m[HANDS[side]..][..HAND_JOINTS], dt_s);
            for (i, held_n_m) in self.payload[side].torques_n_m(&arm).into_iter().enumerate() {
                load_n_m[first + i] += held_n_m;
            }
        }
        load_n_m
    }

    /// Returns the external force on each hand (world frame).
    pub(super) fn force_n(&self) -> Sides<Vector> {
        self.force.each_ref().map(HandForce::force_n)
    }

    /// Returns the force on each hand plus the inertia of the moving arm, which is the load on the trunk.
    pub(super) fn reaction_n(&self) -> Sides<Vector> {
        self.reaction.each_ref().map(HandForce::force_n)
    }

    /// Returns true for hands whose thumb or fingers press on an object.
    pub(super) fn presses(&self) -> Sides<bool> {
        self.grip.each_ref().map(|grip| grip.presses)
    }

    /// Returns true for hands whose thumb and fingers both press on an object.
    pub(super) fn holds(&self) -> Sides<bool> {
        self.grip.each_ref().map(Grip::holds)
    }

    #[cfg(test)]
    fn weight_n(&self) -> Sides<f32> {
        self.payload.each_ref().map(Payload::weight_n)
    }
}

/// Detection of presses by thumb and fingers.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Grip {
    torque_n_m: [f32; HAND_JOINTS],
    holds: bool,
    presses: bool,
}

impl Grip {
    /// Runs one physics step. Torques of the thumb's joints come first, then those of the finger joints.
    fn update(&mut self, torque_n_m: &[f32], dt_s: f32) {
        for (felt_n_m, torque_n_m) in self.torque_n_m.iter_mut().zip(torque_n_m) {
            *felt_n_m += (torque_n_m - *felt_n_m) * (dt_s / GRIP_FILTER_TIME_S);
        }
        let (thumb, fingers) = self.torque_n_m.split_at(THUMB_JOINTS);
        let press = |joints: &&[f32], pressed: bool| {
            let least_n_m = if pressed { MIN_PRESS_N_M * STILL_PRESSES } else { MIN_PRESS_N_M };
            joints.iter().any(|torque| torque.abs() > least_n_m)
        };
        let parts = [thumb, fingers];
        self.holds = parts.iter().all(|joints| press(joints, self.holds));
        self.presses = parts.iter().any(|joints| press(joints, self.presses));
    }

    fn holds(&self) -> bool {
        self.holds
    }
}

/// Least squares fit of the force on a palm that explains most of the torques on an arm's joints.
struct PalmFit {
    jacobian_m: SMatrix<f32, 3, ARM_JOINTS>,
    factor: Option<Cholesky<f32, Const<3>>>,
}

impl PalmFit {
    fn of(levers_m: &[[f32; ARM_JOINTS]; 3]) -> PalmFit {
        let jacobian_m = SMatrix::<f32, 3, ARM_JOINTS>::from_fn(|row, column| levers_m[row][column]);
        let normal_m2 = jacobian_m * jacobian_m.transpose() + SMatrix::identity() * FORCE_DAMPING_M2;
        PalmFit { jacobian_m, factor: normal_m2.cholesky() }
    }

    fn force_n(&self, outside_n_m: [f32; ARM_JOINTS]) -> Option<Vector> {
        let fitted = self.factor.as_ref()?.solve(&(self.jacobian_m * SVector::from(outside_n_m)));
        Some(Vector::new(fitted.x, fitted.y, fitted.z))
    }
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct HandForce {
    force_n: Vector,
}

impl HandForce {
    /// Returns the force in the world frame.
    fn force_n(&self) -> Vector {
        self.force_n
    }

    /// Runs one physics step, in which the external torques `outside_n_m` acted on the joints.
    fn update(&mut self, fit: &PalmFit, outside_n_m: [f32; ARM_JOINTS], filter_time_s: f32, dt_s: f32) {
        let Some(fitted_n) = fit.force_n(outside_n_m) else { return };
        let measured_n = fitted_n.clamp_length_max(LARGEST_FORCE_N);
        self.force_n += (measured_n - self.force_n) * (dt_s / filter_time_s);
    }
}

#[derive(Clone, Default, Serialize, Deserialize)]
struct Payload {
    weight_n: f32,
}

impl Payload {
    #[cfg(test)]
    fn weight_n(&self) -> f32 {
        self.weight_n
    }

    /// Runs one physics step.
    fn update(&mut self, arm: &Arm, dt_s: f32) {
        let lever_m = &arm.levers_m[2];
        let square: f32 = lever_m.iter().map(|lever| lever * lever).sum();
        let along: f32 = lever_m.iter().zip(&arm.excess_n_m).map(|(lever, excess)| lever * excess).sum();
        let total: f32 = arm.excess_n_m.iter().map(|excess| excess * excess).sum();
        let explained = along * along / (square * total).max(1e-6);
        let measured_n = if explained > MIN_EXPLAINED_SHARE { along / square } else { 0.0 };
        let measured_n = measured_n.clamp(0.0, LARGEST_WEIGHT_N);
        self.weight_n += (measured_n - self.weight_n) * (dt_s / WEIGHT_FILTER_TIME_S);
    }

    /// Returns the torques of the arm's joints that carry the estimated weight.
    fn torques_n_m(&self, arm: &Arm) -> [f32; ARM_JOINTS] {
        arm.levers_m[2].map(|lever_m| FED_FORWARD_SHARE * self.weight_n * lever_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::posed::{Posed, model};
    use crate::{PHYSICS_DT_S, Side};

    /// Returns a robot with its arms bent in front of the body.
    fn holding() -> BodyEstimate {
        let mut posed = Posed::standing();
        for (side, first) in ARMS.by_side() {
            let bent_rad = [-0.4, 0.2 * side.sign(), 0.1 * side.sign(), 0.6, 0.0, 0.2, 0.0];
            posed.q_rad[first..first + ARM_JOINTS].copy_from_slice(&bent_rad);
        }
        posed.body()
    }

    /// Runs long enough for the filters, with torques that hold the arms against gravity and a force on
    /// each palm.
    fn feel(body: &BodyEstimate, force_n: Sides<Vector>) -> (HandLoads, [f32; JOINTS]) {
        let mut torque_n_m = body.gravity_torques_n_m();
        for (side, first) in ARMS.by_side() {
            let (palm_m, force_n) = (body.palms_m()[side], force_n[side]);
            for (joint, torque_n_m) in torque_n_m.iter_mut().enumerate().skip(first).take(ARM_JOINTS) {
                *torque_n_m -= body.moment_n_m(joint, palm_m, force_n);
            }
        }
        let mut feeling = HandLoads::default();
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
        // Most of the weight is fed forward, on top of gravity.
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
        // A quarter may be missing, because damping takes a part, most of it along the arm.
        let body = holding();
        for force_n in
            [Vector::new(0.0, 0.0, -12.0), Vector::new(10.0, 0.0, 0.0), Vector::new(-3.0, 8.0, 5.0)]
        {
            let (feeling, _) = feel(&body, Sides { left: force_n, right: -force_n });
            for (side, expected_n) in (Sides { left: force_n, right: -force_n }).by_side() {
                for found_n in [feeling.force_n()[side], feeling.reaction_n()[side]] {
                    let error_n = (found_n - expected_n).length();
                    assert!(error_n < 0.25 * expected_n.length(), "{side:?}: {found_n}, not {expected_n}");
                }
            }
        }
    }

    /// A table under the hand and a pull to the side are not carried weights.
    #[test]
    fn only_weights_are_carried() {
        for force_n in [Vector::Z * 15.0, Vector::Y * 15.0] {
            let (feeling, _) = feel(&holding(), Sides::both(force_n));
            assert_eq!(feeling.weight_n(), Sides::both(0.0), "under {force_n}");
        }
        let (feeling, _) = feel(&holding(), Sides::both(Vector::Z * -300.0));
        assert!(feeling.weight_n()[Side::Left] < 35.1 && feeling.force_n().left.length() < 80.1, "an impact");
    }

    #[test]
    fn a_hand_holds_while_thumb_and_fingers_press() {
        let body = holding();
        let mut feeling = HandLoads::default();
        let mut press = |thumb_n_m: f32, finger_n_m: f32| {
            let mut torque_n_m = body.gravity_torques_n_m();
            torque_n_m[HANDS.left + 1] = thumb_n_m;
            torque_n_m[HANDS.left + THUMB_JOINTS] = finger_n_m;
            for _ in 0..400 {
                feeling.update(&body, &torque_n_m, PHYSICS_DT_S);
            }
            feeling.holds()
        };
        assert_eq!(press(0.5, 0.1), Sides::both(false), "a thumb alone");
        assert_eq!(press(-0.1, 0.5), Sides::both(false), "a finger alone");
        let left = Sides { left: true, right: false };
        assert_eq!(press(-0.3, 0.3), left);
        assert_eq!(press(-0.15, 0.15), left, "it does not let go of what it presses a little less");
        assert_eq!(press(-0.15, 0.05), Sides::both(false), "the fingers have let go");
    }
}
