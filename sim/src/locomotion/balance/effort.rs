//! Leg torques by inverse dynamics: trunk and feet accelerate as wanted, and the ground reacts at the
//! wanted point.

#[cfg(test)]
mod tests;

use rapier3d::math::Vector;
use rapier3d::na::{SMatrix, SVector};

use super::ground::{FootForce, distribute, leg_torques_n_m};
use super::load::Load;
use crate::body::{Acceleration, BodyEstimate, Effort, JOINTS, LEG_JOINTS, LEGS};
use crate::plane::flat;
use crate::{GRAVITY_M_S2, Side, Sides};

/// Maximum ratio of horizontal to vertical force that is used. Friction provides it with certainty.
const FRICTION_USED: f32 = 0.43;
/// Maximum moment about the vertical that a foot is given. Friction at its corners holds 15 N m. It holds
/// less if the pressure is at toe or heel, where the corners are close.
const LARGEST_TURN_N_M: f32 = 14.0;
const TURN_FADE_M: f32 = 0.12;
/// Inertia of trunk and arms about the vertical.
const TURN_INERTIA_KG_M2: f32 = 1.2;
const CORRECTIONS: usize = 2;
/// Minimum height of the centre of mass over the ground: a lower robot has fallen.
const MIN_HEIGHT_M: f32 = 0.4;
/// Damping of the legs' inverse: a knee that is almost straight must not demand the impossible.
const DAMPING: f32 = 0.004;
/// Damping of the ground force inferred from torques. With twenty times this damping, half of a pull on a
/// leaning robot is not detected: its legs are almost straight.
const FORCE_DAMPING: f32 = 0.0002;
const LARGEST_JOINT_ACCELERATION_RAD_S2: f32 = 400.0;

/// Share of the joints' torque limits that torques may use, as long as reducing the wanted motion helps.
const EFFORT_USED: f32 = 0.9;
/// Shares of the wanted turning and of the feet's acceleration that remain at full reduction.
const EASED_TURN: f32 = 0.64;
const EASED_FEET: f32 = 0.2;

/// Wanted accelerations, world frame.
pub(super) struct WantedMotion {
    pub lift_m_s2: f32,
    pub turn_rad_s2: Vector,
    /// Accelerations of the ankle roll links; zero for a stance foot.
    pub feet: Sides<Acceleration>,
}

/// Place where the ground acts on the feet.
pub(super) struct GroundContact {
    pub pressure_m: Vector,
    /// The only stance foot; `None` if both feet stand.
    pub foot: Option<Side>,
}

/// Torques of both legs.
pub(super) struct LegTorques {
    pub torque_n_m: Sides<[f32; LEG_JOINTS]>,
    /// Resulting horizontal acceleration of the centre of mass.
    pub acceleration_m_s2: Vector,
}

/// Computes [`leg_torques`], with trunk and feet driven less hard if a joint's limit would be exceeded.
/// Saturated torques fit no motion, and tip the stance foot.
pub(super) fn leg_torques_within_limits(
    body: &BodyEstimate,
    load: &Load,
    motion: &WantedMotion,
    contact: &GroundContact,
) -> LegTorques {
    let full = leg_torques(body, load, motion, contact);
    let most_n_m = |side: Side, i: usize| body.model.joints[LEGS[side] + i].effort_n_m * EFFORT_USED;
    let joints = || Side::BOTH.into_iter().flat_map(|side| (0..LEG_JOINTS).map(move |i| (side, i)));
    if joints().all(|(side, i)| full.torque_n_m[side][i].abs() <= most_n_m(side, i)) {
        return full;
    }
    let eased = WantedMotion {
        lift_m_s2: motion.lift_m_s2,
        turn_rad_s2: motion.turn_rad_s2 * EASED_TURN,
        feet: motion.feet.map(|foot| Acceleration {
            linear_m_s2: foot.linear_m_s2 * EASED_FEET,
            angular_rad_s2: foot.angular_rad_s2 * EASED_FEET,
        }),
    };
    let eased = leg_torques(body, load, &eased, contact);
    let mut share = 1.0_f32;
    for (side, i) in joints() {
        let (low, high) = (eased.torque_n_m[side][i], full.torque_n_m[side][i]);
        let most = most_n_m(side, i);
        if high.abs() > most && low.abs() < most {
            share = share.min((most * high.signum() - low) / (high - low));
        }
    }
    let between = |low: f32, high: f32| low + (high - low) * share;
    LegTorques {
        torque_n_m: Sides::from_fn(|side| {
            std::array::from_fn(|i| between(eased.torque_n_m[side][i], full.torque_n_m[side][i]))
        }),
        acceleration_m_s2: eased.acceleration_m_s2
            + (full.acceleration_m_s2 - eased.acceleration_m_s2) * share,
    }
}

/// Computes the torques of both legs. The sideways acceleration of the pelvis is such that the ground force
/// has no moment about the pressure point. The turning acceleration is limited to what one foot can hold.
/// Both are linear in the pelvis's acceleration, and found by correcting it [`CORRECTIONS`] times.
fn leg_torques(
    body: &BodyEstimate,
    load: &Load,
    motion: &WantedMotion,
    contact: &GroundContact,
) -> LegTorques {
    let point_m = contact.pressure_m;
    let scale = &body.model.scale;
    let height_m = (body.com_m.z - point_m.z).max(scale.length_m(MIN_HEIGHT_M));
    let away_m = flat(body.com_m - point_m);
    let mut pelvis = Acceleration {
        linear_m_s2: away_m * ((GRAVITY_M_S2 + motion.lift_m_s2) / height_m) + Vector::Z * motion.lift_m_s2,
        angular_rad_s2: motion.turn_rad_s2,
    };
    let most_turn_n_m = contact.most_turn_n_m(body);
    let mut qdd_rad_s2 = [0.0; JOINTS];
    let mut reaction = GroundReaction::of(body, load, motion, pelvis, point_m, &mut qdd_rad_s2);
    for _ in 0..CORRECTIONS {
        reaction.correct(&mut pelvis, body, height_m, most_turn_n_m);
        reaction = GroundReaction::of(body, load, motion, pelvis, point_m, &mut qdd_rad_s2);
    }
    let turn_n_m = Vector::Z * reaction.rest_n_m.z.clamp(-most_turn_n_m, most_turn_n_m);
    let pushes_n_m = reaction.pushes_n_m(body, contact, turn_n_m);
    LegTorques {
        torque_n_m: Sides::from_fn(|side| {
            std::array::from_fn(|i| reaction.effort.torque_n_m[LEGS[side] + i] + pushes_n_m[side][i])
        }),
        acceleration_m_s2: flat(reaction.force_n) / body.model.mass_kg,
    }
}

impl GroundContact {
    /// Returns the maximum moment about the vertical. A foot holds less the nearer the pressure is to
    /// toe or heel.
    fn most_turn_n_m(&self, body: &BodyEstimate) -> f32 {
        let scale = &body.model.scale;
        let largest_n_m = scale.moment_n_m(LARGEST_TURN_N_M);
        match self.foot {
            Some(side) => {
                let sole_from_world = body.world_from_soles()[side].inverse();
                let along_m = (sole_from_world * self.pressure_m).x.abs();
                largest_n_m * (1.0 - along_m / scale.along_sole_m(TURN_FADE_M)).max(0.1)
            }
            None => largest_n_m,
        }
    }
}

/// Ground reaction to a motion of the pelvis.
struct GroundReaction {
    effort: Effort,
    force_n: Vector,
    /// Moment about the pressure point that the force cannot provide.
    rest_n_m: Vector,
}

impl GroundReaction {
    fn of(
        body: &BodyEstimate,
        load: &Load,
        motion: &WantedMotion,
        pelvis: Acceleration,
        point_m: Vector,
        qdd_rad_s2: &mut [f32; JOINTS],
    ) -> GroundReaction {
        let effort = body.inverse_dynamics(pelvis, qdd_rad_s2);
        move_feet(body, motion, &effort, qdd_rad_s2);
        let effort = body.inverse_dynamics(pelvis, qdd_rad_s2);
        let pelvis_m = body.world_from_pelvis().translation;
        let rest_n_m = effort.moment_n_m + (pelvis_m - point_m).cross(effort.force_n)
            - load.moment_n_m
            - (body.com_m - point_m).cross(load.force_n);
        GroundReaction { force_n: effort.force_n - load.force_n, rest_n_m, effort }
    }

    /// Accelerates the pelvis away from the remaining moment, no harder than friction allows, and turns
    /// it less if the foot would spin.
    fn correct(&self, pelvis: &mut Acceleration, body: &BodyEstimate, height_m: f32, most_turn_n_m: f32) {
        let mass_kg = body.model.mass_kg;
        let away = Vector::new(-self.rest_n_m.y, self.rest_n_m.x, 0.0);
        pelvis.linear_m_s2 += away / (mass_kg * height_m);
        let force_n = self.force_n + away / height_m;
        let sliding = flat(force_n).length() / (FRICTION_USED * force_n.z.max(1.0));
        if sliding > 1.0 {
            pelvis.linear_m_s2 -= flat(force_n) * ((1.0 - 1.0 / sliding) / mass_kg);
        }
        let too_much_n_m = self.rest_n_m.z - self.rest_n_m.z.clamp(-most_turn_n_m, most_turn_n_m);
        pelvis.angular_rad_s2.z -= too_much_n_m / body.model.scale.inertia_kg_m2(TURN_INERTIA_KG_M2);
    }

    /// Returns the torques with which the legs push on the ground.
    fn pushes_n_m(
        &self,
        body: &BodyEstimate,
        contact: &GroundContact,
        turn_n_m: Vector,
    ) -> Sides<[f32; LEG_JOINTS]> {
        let (force_n, point_m) = (self.force_n, contact.pressure_m);
        match contact.foot {
            Some(side) => {
                let mut pushes_n_m = Sides::both([0.0; LEG_JOINTS]);
                pushes_n_m[side] = leg_torques_n_m(body, side, FootForce { force_n, point_m }, turn_n_m);
                pushes_n_m
            }
            None => {
                let about_com_n_m = self.rest_n_m + (point_m - body.com_m).cross(force_n);
                let feet = distribute(
                    &body.model.scale,
                    body.com_m,
                    force_n,
                    about_com_n_m,
                    body.world_from_soles(),
                );
                Sides::from_fn(|side| leg_torques_n_m(body, side, feet[side], turn_n_m * 0.5))
            }
        }
    }
}

/// Returns the ground force (N) inferred from the torques of one leg whose foot is planted:
///   J^T w = tau_dynamics - tau,  by damped least squares.
pub(super) fn ground_force_n(
    body: &BodyEstimate,
    side: Side,
    dynamics_n_m: &[f32; JOINTS],
    torque_n_m: &[f32; LEG_JOINTS],
) -> Vector {
    let jacobian = foot_jacobian(body, side);
    let rest = SVector::<f32, 6>::from_fn(|i, _| dynamics_n_m[LEGS[side] + i] - torque_n_m[i]);
    let normal = jacobian * jacobian.transpose() + SMatrix::identity() * FORCE_DAMPING;
    normal.cholesky().map_or(Vector::ZERO, |factor| {
        let wrench = factor.solve(&(jacobian * rest));
        Vector::new(wrench[0], wrench[1], wrench[2])
    })
}

/// Returns the Jacobian of a foot: linear over angular velocity per joint velocity of its leg. Without an
/// ankle roll joint, the last column is that of rolling on the sole.
fn foot_jacobian(body: &BodyEstimate, side: Side) -> SMatrix<f32, 6, 6> {
    let first = LEGS[side];
    let foot_m = body.world_from_foot(side).translation;
    let mut jacobian = SMatrix::<f32, 6, 6>::zeros();
    let on_sole = body.model.sole_axis(side, body.world_from_foot(side));
    for i in 0..LEG_JOINTS {
        let own = || body.joint_axis(first + i);
        let (origin, axis) = on_sole.filter(|_| i + 1 == LEG_JOINTS).unwrap_or_else(own);
        let linear = axis.cross(foot_m - origin);
        jacobian.set_column(i, &SVector::from([linear.x, linear.y, linear.z, axis.x, axis.y, axis.z]));
    }
    jacobian
}

/// Changes the joint accelerations of both legs so that the feet accelerate as wanted:
///   (J^T J + damping I) d = J^T (wanted - now).
fn move_feet(body: &BodyEstimate, motion: &WantedMotion, effort: &Effort, qdd_rad_s2: &mut [f32; JOINTS]) {
    for side in Side::BOTH {
        let first = LEGS[side];
        let foot = body.model.soles[side].link;
        let jacobian = foot_jacobian(body, side);
        let (wanted, now) = (motion.feet[side], effort.links[foot]);
        let linear = wanted.linear_m_s2 - now.linear_m_s2;
        let angular = wanted.angular_rad_s2 - now.angular_rad_s2;
        let error = SVector::<f32, 6>::from([linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]);
        let normal = jacobian.transpose() * jacobian + SMatrix::identity() * DAMPING;
        let Some(factor) = normal.cholesky() else { continue };
        let change = factor.solve(&(jacobian.transpose() * error));
        for i in 0..LEG_JOINTS {
            let most = body.model.scale.rate_1_s2(LARGEST_JOINT_ACCELERATION_RAD_S2);
            qdd_rad_s2[first + i] = (qdd_rad_s2[first + i] + change[i]).clamp(-most, most);
        }
    }
}
