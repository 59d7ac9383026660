//! The default base controller: it stands while it can, and steps when commanded to move or pushed out
//! of its stance.

mod course;
mod effort;
mod footstep;
mod gait;
mod ground;
mod legs;
mod load;
mod observer;
mod stand;
mod step;
mod swing;

use rapier3d::math::{Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::{BaseCommand, BaseLimits, BaseVelocity, LegCommand, Locomotion};
use crate::GRAVITY_M_S2;
use crate::body::{BodyEstimate, BodyScale};
use crate::plane::heading_rad;
use ground::middle_m;
use load::{LadenRobot, Load};
use observer::{CALM, PushObserver, QUICK};
use stand::{Ahead, Partner, Resting, Stand, StandingPlace};
use step::Stepping;

const LIMITS: BaseLimits = BaseLimits {
    vx_m_s: [-0.3, 0.4],
    vy_m_s: [-0.3, 0.3],
    yaw_rate_rad_s: [-0.5, 0.5],
    pelvis_height_m: [0.50, 0.76],
};
/// Maximum rate of change of a velocity command.
const LARGEST_CHANGE_M_S2: f32 = 0.8;
const LARGEST_CHANGE_RAD_S2: f32 = 1.5;
/// Thresholds below which a command means to stand.
const STILL_M_S: f32 = 0.01;
const STILL_RAD_S: f32 = 0.01;
/// Distances of the capture point that end standing: forward and backward from the middle of the feet,
/// sideways beyond a sole's centre.
const FORWARD_M: f32 = 0.075;
const BACKWARD_M: f32 = 0.07;
/// Extra forward distance for a robot that leans ahead of a pull.
const FARTHER_M: f32 = 0.01;
const SIDEWAYS_M: f32 = 0.005;
/// Distance of the capture point from the middle of the feet within which both feet count as equally near.
const EITHER_FOOT_M: f32 = 0.01;
/// Weight of the spin in choosing the swing leg. A leg that swings forward turns the pelvis to that leg's
/// side, and a leg that swings backward to the other side. A robot that a blow has set spinning steps with
/// the leg that stops the spin, which is the leg that the spin carries along. This weight, times the spin and
/// the capture point's distance ahead, counts like the capture point's distance to the side. Tuned on punches
/// at shoulders and elbows, seeds 2000-2099.
const SPIN_S_RAD: f32 = 1.0;
/// Minimum time of standing after planting before another change of mode.
const MIN_STANDING_S: f32 = 0.1;
/// Conditions on steps, feet and capture point under which standing succeeds.
const MIN_STEPS: u32 = 2;
const LARGEST_STAGGER_M: f32 = 0.12;
const LARGEST_WIDTH_M: f32 = 0.36;
const CAPTURED_M: f32 = 0.066;
/// Maximum lean against a push: a robot that leans farther would fall when the push ends.
const LARGEST_LEAN_M: f32 = 0.1;

/// Limits of a return after a push out of the stance: the heading error at which the robot is back, and
/// the time after which it gives up.
const BACK_RAD: f32 = 0.1;
const LONGEST_RETURN_S: f32 = 10.0;

/// The controller of one robot, which stands or steps; see the module's text.
#[derive(Default)]
pub struct Balance {
    state: Option<BalanceState>,
}

#[derive(Clone, Serialize, Deserialize)]
struct BalanceState {
    mode: Mode,
    heading_rad: f32,
    /// Velocity command after the ramp.
    velocity: BaseVelocity,
    time_in_mode_s: f32,
    /// Rest position of the pelvis over the middle of the soles, heading frame.
    pelvis_from_middle_m: Vector,
    observer: PushObserver,
    quick_observer: PushObserver,
    ahead: Ahead,
    partner: Partner,
    /// Place of a robot that stands with empty hands or was pushed out of that stance, or of a robot that
    /// commands move.
    place: Option<StandingPlace>,
}

#[derive(Clone, Serialize, Deserialize)]
enum Mode {
    Stand(Stand),
    Step(Stepping),
}

/// Capture point relative to the feet, in the heading frame.
struct Stance {
    capture_m: Vector,
    com_m: Vector,
    left_from_right_m: Vector,
}

impl Locomotion for Balance {
    fn limits(&self, scale: &BodyScale) -> BaseLimits {
        limits(scale)
    }

    fn tick(&mut self, body: &BodyEstimate, command: &BaseCommand, dt_s: f32) -> LegCommand {
        let state = self.state.get_or_insert_with(|| BalanceState::new(body));
        let command = limits(&body.model.scale).clamp(*command);
        state.time_in_mode_s += dt_s;
        state.ahead.update(body, &command, dt_s);
        let ground_m =
            body.world_from_soles().iter().map(|sole| sole.translation.z).fold(f32::INFINITY, f32::min);
        let laden = LadenRobot::of(body);
        state.observer.update(laden.velocity_m_s, &CALM, dt_s);
        state.quick_observer.update(laden.velocity_m_s, &QUICK, dt_s);
        let ahead = if matches!(state.mode, Mode::Stand(_)) { state.ahead.share() } else { 0.0 };
        let push = state.observer.push_ahead(&state.quick_observer, ahead);
        let push = state.partner.split(body, push, laden.mass_kg, dt_s);
        let load = Load::of(body, &laden, ground_m, push, ahead);
        let told = state.velocity_to_place(body, &load, command.velocity(), dt_s);
        state.velocity = ramped(state.velocity, told, &body.model.scale, dt_s);
        state.change_mode(body, &load);
        let (legs, expected_m_s2) = match &mut state.mode {
            Mode::Stand(stand) => stand.tick(body, &load, command.pelvis_height_m, dt_s),
            Mode::Step(step) => {
                let done = step.tick(body, &load, state.velocity, command.pelvis_height_m, dt_s);
                state.heading_rad = step.heading_rad;
                done
            }
        };
        let expected_m_s2 = expected_m_s2 * (body.model.mass_kg / laden.mass_kg);
        state.observer.expect(expected_m_s2);
        state.quick_observer.expect(expected_m_s2);
        legs
    }

    fn is_stepping(&self) -> Option<bool> {
        Some(self.state.as_ref().is_some_and(|state| matches!(state.mode, Mode::Step(_))))
    }

    fn let_go(&mut self) {
        self.state = None;
    }

    fn save(&self) -> Result<Vec<u8>, postcard::Error> {
        postcard::to_stdvec(&self.state)
    }

    fn load(&mut self, state: &[u8]) -> Result<(), postcard::Error> {
        self.state = postcard::from_bytes(state)?;
        Ok(())
    }
}

impl BalanceState {
    fn new(body: &BodyEstimate) -> BalanceState {
        let pelvis = body.world_from_pelvis();
        let heading_rad = heading_rad(&pelvis);
        let middle_m = middle_m(&body.world_from_soles());
        let mut pelvis_from_middle_m =
            Rotation::from_rotation_z(-heading_rad) * (pelvis.translation - middle_m);
        pelvis_from_middle_m.z = 0.0;
        BalanceState {
            mode: Mode::Stand(Stand::plant(body, heading_rad, None)),
            heading_rad,
            velocity: BaseVelocity::STILL,
            time_in_mode_s: 0.0,
            pelvis_from_middle_m,
            observer: PushObserver::default(),
            quick_observer: PushObserver::default(),
            ahead: Ahead::default(),
            partner: Partner::default(),
            place: None,
        }
    }

    /// Returns the commanded velocity. If the robot is commanded to stand, this may be the velocity to its
    /// place instead. That is so if the robot was pushed out of its stance, or has not yet reached the place
    /// to which commands moved it.
    fn velocity_to_place(
        &mut self,
        body: &BodyEstimate,
        load: &Load,
        command: BaseVelocity,
        dt_s: f32,
    ) -> BaseVelocity {
        let scale = &body.model.scale;
        let heading_rad = self.heading_rad;
        if is_moving(&command) {
            let mut place = self
                .place
                .filter(StandingPlace::is_moved)
                .unwrap_or_else(|| StandingPlace::of_mover(body, load, heading_rad));
            place.advance(body, load, &command, heading_rad, dt_s);
            self.place = Some(place);
            return command;
        }
        let Mode::Step(step) = &self.mode else {
            self.keep_place(body);
            return command;
        };
        let gives_up = self.time_in_mode_s > scale.time_s(LONGEST_RETURN_S) || !self.ahead.is_free();
        if gives_up && self.place.is_some_and(|place| !place.is_moved()) {
            self.place = None;
        }
        let velocity_m_s = self
            .place
            .as_mut()
            .and_then(|place| place.velocity_m_s(body, load, heading_rad, step.just_landed(), dt_s));
        velocity_m_s.map_or(command, |to_m_s| BaseVelocity { vx_m_s: to_m_s.x, vy_m_s: to_m_s.y, ..command })
    }

    /// Records the place of a robot that stands with empty hands.
    fn keep_place(&mut self, body: &BodyEstimate) {
        if !self.ahead.is_free() || self.place.is_some_and(|place| place.is_moved()) {
            self.place = None;
        }
        if self.ahead.share() == 1.0 {
            let middle_m = middle_m(&body.world_from_soles());
            self.place.get_or_insert(StandingPlace::new(middle_m, self.heading_rad));
        }
    }

    fn change_mode(&mut self, body: &BodyEstimate, load: &Load) {
        let scale = &body.model.scale;
        let moving = is_moving(&self.velocity);
        let stance = self.stance(body, load);
        let half_width_m = stance.left_from_right_m.y * 0.5;
        match &self.mode {
            Mode::Stand(_) => {
                let [forward_m, backward_m, farther_m] =
                    [FORWARD_M, BACKWARD_M, FARTHER_M].map(|g1_m| scale.along_sole_m(g1_m));
                let lost = stance.capture_m.x > forward_m + farther_m * load.ahead
                    || stance.capture_m.x < -backward_m
                    || stance.capture_m.y.abs() > half_width_m + scale.length_m(SIDEWAYS_M);
                if (moving || lost) && self.time_in_mode_s > scale.time_s(MIN_STANDING_S) {
                    let spin_rad_s = body.pelvis_angular_velocity_rad_s.z;
                    let left_carries = self.left_carries_first(scale, &stance, lost.then_some(spin_rad_s));
                    let goal_rad = self.place.map_or(self.heading_rad, |place| place.heading_rad);
                    self.mode = Mode::Step(Stepping::start(body, self.heading_rad, goal_rad, left_carries));
                    self.time_in_mode_s = 0.0;
                }
            }
            Mode::Step(step) => {
                let captured = stance.capture_m.x.abs() < scale.along_sole_m(CAPTURED_M)
                    && stance.capture_m.y.abs() < half_width_m
                    && stance.com_m.x.abs() < scale.length_m(LARGEST_LEAN_M)
                    && stance.com_m.y.abs() < half_width_m;
                let feet_together = stance.left_from_right_m.x.abs() < scale.length_m(LARGEST_STAGGER_M)
                    && stance.left_from_right_m.y < scale.stance_width_m(LARGEST_WIDTH_M);
                let back = self.place.is_none_or(|place| place.is_moved()) || step.to_turn_rad() < BACK_RAD;
                let landed = step.just_landed() && step.steps() >= MIN_STEPS;
                if !moving && back && landed && captured && feet_together {
                    let kept_m = self.place.and_then(|place| place.rest_m(body, load, self.heading_rad));
                    let rest_m = kept_m.unwrap_or(self.pelvis_from_middle_m);
                    let resting = Resting { rest_m, keeps: kept_m.is_some(), load };
                    let stand = Stand::plant(body, self.heading_rad, Some(resting));
                    self.mode = Mode::Stand(stand);
                    self.time_in_mode_s = 0.0;
                }
            }
        }
    }

    /// Returns true if the left foot is the first stance foot. This is the foot nearer to the capture point;
    /// if both are equally near, it is the foot that the robot turns away from. A robot that has lost its
    /// stance also considers its spin: see [`SPIN_S_RAD`].
    fn left_carries_first(&self, scale: &BodyScale, stance: &Stance, lost_rad_s: Option<f32>) -> bool {
        let capture_m = stance.capture_m;
        if let Some(spin_rad_s) = lost_rad_s {
            return capture_m.y + scale.time_s(SPIN_S_RAD) * spin_rad_s * capture_m.x > 0.0;
        }
        let yaw_rate_rad_s = self.velocity.yaw_rate_rad_s;
        if yaw_rate_rad_s.abs() > STILL_RAD_S && capture_m.y.abs() < scale.length_m(EITHER_FOOT_M) {
            yaw_rate_rad_s < 0.0
        } else {
            capture_m.y > 0.0
        }
    }

    fn stance(&self, body: &BodyEstimate, load: &Load) -> Stance {
        let soles = body.world_from_soles();
        let middle_m = middle_m(&soles);
        let height_m = body.com_m.z - middle_m.z;
        let capture_m = load.balance_point_m + load.velocity_m_s * (height_m / GRAVITY_M_S2).sqrt();
        let into_heading = Rotation::from_rotation_z(-self.heading_rad);
        Stance {
            capture_m: into_heading * (capture_m - middle_m),
            com_m: into_heading * (body.com_m - middle_m),
            left_from_right_m: into_heading * (soles.left.translation - soles.right.translation),
        }
    }
}

/// Returns the base commands that a robot of this size can follow.
fn limits(scale: &BodyScale) -> BaseLimits {
    BaseLimits {
        vx_m_s: LIMITS.vx_m_s.map(|g1_m_s| scale.speed_m_s(g1_m_s)),
        vy_m_s: LIMITS.vy_m_s.map(|g1_m_s| scale.speed_m_s(g1_m_s)),
        yaw_rate_rad_s: LIMITS.yaw_rate_rad_s.map(|g1_rad_s| scale.rate_1_s(g1_rad_s)),
        pelvis_height_m: LIMITS.pelvis_height_m.map(|g1_m| scale.height_m(g1_m)),
    }
}

fn is_moving(velocity: &BaseVelocity) -> bool {
    let BaseVelocity { vx_m_s, vy_m_s, yaw_rate_rad_s } = velocity;
    vx_m_s.abs() > STILL_M_S || vy_m_s.abs() > STILL_M_S || yaw_rate_rad_s.abs() > STILL_RAD_S
}

/// Moves a velocity towards another for one physics step.
fn ramped(from: BaseVelocity, to: BaseVelocity, scale: &BodyScale, dt_s: f32) -> BaseVelocity {
    let towards = |from: f32, to: f32, most: f32| from + (to - from).clamp(-most, most);
    let (most_m_s, most_rad_s) = (LARGEST_CHANGE_M_S2 * dt_s, scale.rate_1_s2(LARGEST_CHANGE_RAD_S2) * dt_s);
    BaseVelocity {
        vx_m_s: towards(from.vx_m_s, to.vx_m_s, most_m_s),
        vy_m_s: towards(from.vy_m_s, to.vy_m_s, most_m_s),
        yaw_rate_rad_s: towards(from.yaw_rate_rad_s, to.yaw_rate_rad_s, most_rad_s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::posed::Posed;

    /// Returns true if the left foot is the first stance foot with the capture point here, and with this spin
    /// if the stance was lost.
    fn left_carries(capture_m: [f32; 2], lost_rad_s: Option<f32>) -> bool {
        let body = Posed::standing().body();
        let state = BalanceState::new(&body);
        let load = Load::of(&body, &LadenRobot::of(&body), 0.0, observer::ObservedPush::default(), 0.0);
        let mut stance = state.stance(&body, &load);
        stance.capture_m = Vector::new(capture_m[0], capture_m[1], 0.0);
        state.left_carries_first(&BodyScale::G1, &stance, lost_rad_s)
    }

    /// A forward or backward blow at an elbow sets the robot spinning. It swings the leg that stops the spin,
    /// although the other foot is a little nearer to the capture point.
    #[test]
    fn a_robot_that_spins_steps_with_the_leg_that_stops_it() {
        for (ahead_m, spin_rad_s, left) in
            [(0.08, 2.0, true), (0.08, -2.0, false), (-0.08, 2.0, false), (-0.08, -2.0, true)]
        {
            for side_m in [0.05, -0.05] {
                let capture_m = [ahead_m, side_m];
                assert_eq!(left_carries(capture_m, Some(spin_rad_s)), left, "{capture_m:?}, {spin_rad_s}");
            }
        }
    }

    #[test]
    fn a_robot_that_does_not_spin_stands_on_the_nearer_foot() {
        for side_m in [0.12, -0.12] {
            for lost_rad_s in [None, Some(0.3), Some(-0.3)] {
                assert_eq!(
                    left_carries([0.08, side_m], lost_rad_s),
                    side_m > 0.0,
                    "{side_m}, {lost_rad_s:?}"
                );
            }
        }
    }
}
