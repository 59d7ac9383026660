//! The place at which a robot stands or is to stand.

use rapier3d::math::{Rotation, Vector};
use serde::{Deserialize, Serialize};

use super::super::ground::middle_m;
use super::super::load::Load;
use crate::body::{BodyEstimate, BodyScale};
use crate::locomotion::BaseVelocity;
use crate::plane::flat;

/// Maximum distance at which a robot that was pushed out of its stance steps back to its place. Within
/// `BACK_M` it counts as back.
const LEASH_M: f32 = 1.0;
const BACK_M: f32 = 0.04;
const RETURN_1_S: f32 = 1.0;
const RETURN_M_S: f32 = 0.15;

/// Time for which a stopping robot coasts at its present speed.
const COASTS_S: f32 = 0.2;
/// Maximum duration of a short move. After a short move, the robot continues to step until its feet are near
/// its commanded place, or for a limited time. In a longer walk the caller corrects the commands by
/// observation, so the robot stops as soon as it can.
const MOVED_SHORT_S: f32 = 2.5;
/// Time in which a longer walk discards the robot's lag or lead on its command. An error beyond the leash is
/// discarded at once.
const FORGETS_S: f32 = 4.0;
const MOVED_LEASH_M: f32 = 0.25;
const MOVED_NEAR_M: f32 = 0.012;
const MOVED_LONGEST_S: f32 = 0.4;
const MOVED_RETURN_1_S: f32 = 2.0;
const MOVED_RETURN_M_S: f32 = 0.2;
/// Maximum shift of the pelvis that compensates the position error of the feet after a commanded move.
const MOVED_SHIFT_M: f32 = 0.04;
/// The same maximum for a robot that holds an object with partners.
const HELD_SHIFT_M: f32 = 0.02;

/// Middle of the soles and heading of a standing robot, or of a robot that stops at the place to which
/// commands have moved it.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(in crate::locomotion::balance) struct StandingPlace {
    pub middle_m: Vector,
    pub heading_rad: f32,
    moved: Option<MovedPlace>,
}

/// State of a place that commands move.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct MovedPlace {
    /// Pelvis relative to the robot's centre of mass, loads included, once the robot stands with its present
    /// arm posture; heading frame.
    rest_m: Vector,
    /// Contribution of the legs to the offset from the pelvis to the centre of mass in the last stance,
    /// heading frame.
    standing_legs_m: Vector,
    /// Time for which commands have moved the place, and time since they ended.
    told_s: f32,
    ended_s: f32,
}

impl StandingPlace {
    /// Creates the place of a robot that stands here.
    pub(in crate::locomotion::balance) fn new(middle_m: Vector, heading_rad: f32) -> StandingPlace {
        StandingPlace { middle_m, heading_rad, moved: None }
    }

    /// Creates the place of a robot that commands begin to move. Its feet will be under the present centre of
    /// mass, so that the pelvis need not move.
    pub(in crate::locomotion::balance) fn of_mover(
        body: &BodyEstimate,
        load: &Load,
        heading_rad: f32,
    ) -> StandingPlace {
        let middle_m = flat(load.weights_point_m);
        let away_m = flat(body.world_from_pelvis().translation - middle_m);
        let rest_m = Rotation::from_rotation_z(-heading_rad) * away_m;
        let standing_legs_m = legs_m(body, heading_rad);
        StandingPlace {
            middle_m,
            heading_rad,
            moved: Some(MovedPlace { rest_m, standing_legs_m, told_s: 0.0, ended_s: 0.0 }),
        }
    }

    /// Moves the point under the centre of mass as arms and loads have shifted the centre relative to
    /// the pelvis; the pelvis's place is unchanged.
    fn follow_arms(&mut self, body: &BodyEstimate, load: &Load, heading_rad: f32) {
        let Some(moved) = &mut self.moved else { return };
        let away_m = flat(body.world_from_pelvis().translation - load.weights_point_m);
        let legs_m = moved.standing_legs_m - legs_m(body, heading_rad);
        let rest_m = Rotation::from_rotation_z(-heading_rad) * away_m - legs_m;
        self.middle_m += Rotation::from_rotation_z(self.heading_rad) * (moved.rest_m - rest_m);
        moved.rest_m = rest_m;
    }

    /// Returns true if commands have moved the robot to this place.
    pub(in crate::locomotion::balance) fn is_moved(&self) -> bool {
        self.moved.is_some()
    }

    /// Moves the place by a command for one physics step.
    pub(in crate::locomotion::balance) fn advance(
        &mut self,
        body: &BodyEstimate,
        load: &Load,
        command: &BaseVelocity,
        heading_rad: f32,
        dt_s: f32,
    ) {
        let scale = &body.model.scale;
        self.follow_arms(body, load, heading_rad);
        let way_m = Vector::new(command.vx_m_s, command.vy_m_s, 0.0) * dt_s;
        // The robot turns about its pelvis.
        let [old, turned] = [self.heading_rad, heading_rad].map(Rotation::from_rotation_z);
        let rest_m = self.moved.map_or(Vector::ZERO, |moved| moved.rest_m);
        let robot_m = flat(load.weights_point_m);
        let mut away_m = flat(self.middle_m) + old * rest_m + turned * (way_m - rest_m) - robot_m;
        if self.moved.is_some_and(|moved| moved.told_s > scale.time_s(MOVED_SHORT_S)) {
            let coming_m = flat(load.velocity_m_s) * scale.time_s(COASTS_S);
            away_m += (coming_m - away_m) * (dt_s / scale.time_s(FORGETS_S));
        }
        self.middle_m = robot_m + away_m.clamp_length_max(scale.length_m(MOVED_LEASH_M));
        self.heading_rad = heading_rad;
        if let Some(moved) = &mut self.moved {
            moved.told_s += dt_s;
            moved.ended_s = 0.0;
        }
    }

    /// Returns the velocity (heading frame) with which a stepping robot approaches its place, and
    /// advances by one physics step. `landed` means that a foot has just touched down. Returns `None`
    /// once the robot is there, or has tried for long enough.
    pub(in crate::locomotion::balance) fn velocity_m_s(
        &mut self,
        body: &BodyEstimate,
        load: &Load,
        heading_rad: f32,
        landed: bool,
        dt_s: f32,
    ) -> Option<Vector> {
        self.follow_arms(body, load, heading_rad);
        let scale = &body.model.scale;
        let feet_m = middle_m(&body.world_from_soles());
        let Some(moved) = &mut self.moved else {
            let away_m = flat(self.middle_m - feet_m).clamp_length_max(scale.length_m(LEASH_M));
            self.middle_m = feet_m + away_m;
            let back = away_m.length() < scale.length_m(BACK_M);
            return (!back).then(|| towards_m_s(scale, away_m, heading_rad, RETURN_1_S, RETURN_M_S));
        };
        moved.ended_s += dt_s;
        let there = landed && flat(self.middle_m - feet_m).length() < scale.length_m(MOVED_NEAR_M);
        if there || moved.told_s > scale.time_s(MOVED_SHORT_S) {
            moved.ended_s = f32::INFINITY;
        }
        let goes_on = moved.ended_s < scale.time_s(MOVED_LONGEST_S);
        let away_m = flat(self.middle_m - load.weights_point_m);
        goes_on.then(|| towards_m_s(scale, away_m, heading_rad, MOVED_RETURN_1_S, MOVED_RETURN_M_S))
    }

    /// Returns the rest position of the pelvis over the middle of the feet, heading frame, for a robot
    /// that stops here. Returns `None` if no command moved it.
    pub(in crate::locomotion::balance) fn rest_m(
        &self,
        body: &BodyEstimate,
        load: &Load,
        heading_rad: f32,
    ) -> Option<Vector> {
        let moved = self.moved?;
        let scale = &body.model.scale;
        if moved.told_s > scale.time_s(MOVED_SHORT_S) {
            return Some(moved.rest_m);
        }
        let off_m = flat(self.middle_m - middle_m(&body.world_from_soles()));
        let most_m = MOVED_SHIFT_M + (HELD_SHIFT_M - MOVED_SHIFT_M) * load.yield_share;
        let off_m = off_m.clamp_length_max(scale.length_m(most_m));
        Some(moved.rest_m + Rotation::from_rotation_z(-heading_rad) * off_m)
    }
}

/// Returns the legs' contribution to the offset from the pelvis to the centre of mass; horizontal,
/// heading frame.
fn legs_m(body: &BodyEstimate, heading_rad: f32) -> Vector {
    let pelvis_m = body.world_from_pelvis().translation;
    let joints = body.model.leg_chains.iter().flatten().map(|joint| &body.model.joints[*joint]);
    let moment_kg_m: Vector = joints
        .map(|joint| {
            let mass = &body.model.links[joint.link].mass;
            (body.world_from_link[joint.link] * mass.local_com - pelvis_m) * mass.mass()
        })
        .sum();
    Rotation::from_rotation_z(-heading_rad) * flat(moment_kg_m / body.model.mass_kg)
}

fn towards_m_s(scale: &BodyScale, away_m: Vector, heading_rad: f32, rate_1_s: f32, most_m_s: f32) -> Vector {
    let away_m = Rotation::from_rotation_z(-heading_rad) * away_m;
    (away_m * scale.rate_1_s(rate_1_s)).clamp_length_max(scale.speed_m_s(most_m_s))
}

#[cfg(test)]
mod tests {
    use super::super::super::load::LadenRobot;
    use super::super::super::observer::ObservedPush;
    use super::*;
    use crate::body::posed::Posed;
    use crate::body::{ARMS, LEGS};

    const DT_S: f32 = 1.0 / 200.0;

    fn load(body: &BodyEstimate) -> Load {
        Load::of(body, &LadenRobot::of(body), 0.0, ObservedPush::default(), 0.0)
    }

    /// Returns the place after a command of some seconds to a robot that has not moved.
    fn moved(command: &BaseVelocity, seconds: f32) -> (BodyEstimate, StandingPlace) {
        let body = Posed::standing().body();
        let mut place = StandingPlace::of_mover(&body, &load(&body), 0.0);
        for _ in 0..(seconds / DT_S) as usize {
            place.advance(&body, &load(&body), command, 0.0, DT_S);
        }
        (body, place)
    }

    /// Returns the vector from the robot's centre of mass to a place.
    fn way_m(body: &BodyEstimate, place: &StandingPlace) -> Vector {
        flat(place.middle_m - load(body).weights_point_m)
    }

    #[test]
    fn a_short_command_moves_the_place_by_its_velocity_times_its_duration() {
        let command = BaseVelocity { vx_m_s: 0.2, ..BaseVelocity::STILL };
        let (body, place) = moved(&command, 3.0);
        let way_m = way_m(&body, &place);
        assert!((way_m.x - MOVED_LEASH_M).abs() < 1e-4, "a robot that is held back is not owed {way_m}");
        for seconds in [0.5, 1.0] {
            let (body, place) = moved(&command, seconds);
            let way_m = self::way_m(&body, &place);
            assert!((way_m - Vector::X * (0.2 * seconds)).length() < 2e-3, "{way_m} in {seconds} s");
        }
    }

    #[test]
    fn a_robot_that_turns_in_place_keeps_its_pelvis_there() {
        const TURN_RAD: f32 = 0.8;
        let mut posed = Posed::standing();
        let mut place = StandingPlace::of_mover(&posed.body(), &load(&posed.body()), 0.0);
        let from_m = place.middle_m;
        posed.world_from_pelvis.rotation = Rotation::from_rotation_z(TURN_RAD);
        let body = posed.body();
        place.advance(&body, &load(&body), &BaseVelocity::STILL, TURN_RAD, DT_S);
        assert!(way_m(&body, &place).length() < 1e-4, "feet come under the centre of mass");
        assert!((place.middle_m - from_m).length() > 0.01, "which is ahead of the pelvis");
        let rest_m = place.moved.expect("commands moved it").rest_m;
        let pelvis_m = place.middle_m + Rotation::from_rotation_z(TURN_RAD) * rest_m;
        assert!(flat(pelvis_m - body.world_from_pelvis().translation).length() < 1e-4, "{pelvis_m}");
    }

    #[test]
    fn feet_go_under_what_arms_reach_out_and_legs_that_bend_change_nothing() {
        let standing = Posed::standing();
        let place = StandingPlace::of_mover(&standing.body(), &load(&standing.body()), 0.0);
        let after = |by_rad: &[(usize, f32)]| {
            let mut posed = standing.clone();
            for (joint, by_rad) in by_rad {
                posed.q_rad[*joint] += by_rad;
            }
            let body = posed.body();
            let mut place = place;
            place.follow_arms(&body, &load(&body), 0.0);
            let rest_m = place.moved.expect("commands moved it").rest_m;
            (place.middle_m, flat(place.middle_m + rest_m - body.world_from_pelvis().translation))
        };
        let (reaching_m, pelvis_off_m) = after(&[(ARMS.left, -1.0), (ARMS.right, -1.0)]);
        assert!((reaching_m - place.middle_m).x > 0.01 && pelvis_off_m.length() < 1e-5, "{reaching_m}");
        let bent = LEGS.into_iter().flat_map(|first| [(first, -0.4), (first + 3, 0.8), (first + 4, -0.4)]);
        let (bent_m, pelvis_off_m) = after(&bent.collect::<Vec<_>>());
        assert!((bent_m - place.middle_m).length() < 1e-5 && pelvis_off_m.length() < 1e-5, "{bent_m}");
    }

    #[test]
    fn a_robot_that_stopped_goes_to_its_place_until_it_is_there_or_time_is_up() {
        let command = BaseVelocity { vx_m_s: 0.2, ..BaseVelocity::STILL };
        let (body, mut place) = moved(&command, 0.5);
        let load = load(&body);
        let mut to_m_s = |landed: bool| place.velocity_m_s(&body, &load, 0.0, landed, DT_S);
        assert!(to_m_s(true).expect("it is 10 cm away").x > 0.1);
        let steps = (0..1000).take_while(|_| to_m_s(false).is_some()).count();
        assert!((steps as f32 * DT_S - MOVED_LONGEST_S).abs() < 0.02, "{steps} steps");
        let feet_m = middle_m(&body.world_from_soles());
        let mut place = StandingPlace { middle_m: feet_m + Vector::X * 0.01, ..place };
        assert_eq!(place.velocity_m_s(&body, &load, 0.0, true, DT_S), None, "feet are within a centimetre");
        assert_eq!(place.velocity_m_s(&body, &load, 0.0, false, DT_S), None);
        let (body, mut place) = moved(&command, MOVED_SHORT_S + 0.1);
        assert_eq!(place.velocity_m_s(&body, &load, 0.0, false, DT_S), None, "it has walked far");
    }

    #[test]
    fn the_pelvis_makes_up_for_a_little_of_what_the_feet_are_off() {
        let (body, place) = moved(&BaseVelocity { vy_m_s: 0.1, ..BaseVelocity::STILL }, 2.0);
        let stood_m = place.moved.expect("commands moved it").rest_m;
        let shift_m = place.rest_m(&body, &load(&body), 0.0).expect("commands moved it") - stood_m;
        assert!((shift_m.length() - MOVED_SHIFT_M).abs() < 1e-4 && shift_m.y > 0.03, "{shift_m}");
        let (body, far) = moved(&BaseVelocity { vy_m_s: 0.1, ..BaseVelocity::STILL }, MOVED_SHORT_S + 0.1);
        assert_eq!(far.rest_m(&body, &load(&body), 0.0), Some(stood_m), "it has walked far");
        assert_eq!(StandingPlace::new(Vector::ZERO, 0.0).rest_m(&body, &load(&body), 0.0), None);
    }
}
