//! Separation of a partner's pull through a shared load from forces of the world.
//!
//! Robots that hold one load are coupled by a spring: arms and a table have about 1000 N/m. Each robot comes
//! to rest over its feet within a centimetre or two. This causes a force of 20 to 30 N between them, which
//! the observer takes for a push. A robot may feed this force forward, lean against it and count it as a loss
//! of stance. It then holds its own place to the millimetre, and so does its partner: two integrators at the
//! ends of one spring. 27 N at the hands move the balance point by 7 cm. Therefore robots at rest stepped out
//! of a safe stance, pulled each other while they stepped, and came to rest elsewhere, without end. Two
//! robots that step and lean against each other with all of the force are even in equilibrium at any force.
//!
//! Therefore a robot whose fingers press on an object attributes the part of the push that its hands sense to
//! a partner. It resists that part with the stiffness of its pelvis alone, and steps as if that part were
//! absent, which lets the force decay. The part that the hands do not sense, for example a shove at the
//! chest, is withstood as before, except for the share that friction and moving arms leave unexplained. A
//! pull on the hands beyond what the feet can hold is attributed to the world, and is withstood, too. It is
//! sufficient that either fingers or thumb press: hands that hook round a table's leg press with only one of
//! the two.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

use super::super::observer::{ObservedPush, SplitPush};
use crate::body::BodyEstimate;
use crate::plane::flat;

const BEGINS_1_S: f32 = 2.0;
/// Rate at which a hold ends: fingers that slip on an edge press again within a moment.
const ENDS_1_S: f32 = 1.0;
/// Minimum pull on the hands (38 N on a G1) that is attributed to the world. The pull has to last for
/// `STRONG_S`. It is attributed to the world until it falls below the share `STILL_STRONG` of the minimum.
const STRONG_M_S2: f32 = 1.1;
const STRONG_S: f32 = 0.1;
const STILL_STRONG: f32 = 0.5;
const WITHSTANDS_1_S: f32 = 5.0;
const GIVES_WAY_1_S: f32 = 1.0;
/// Factor and offset on the sensed force: the estimate for a stretched arm is a quarter too small, and slower
/// than the observer.
const EXPLAINED_SHARE: f32 = 1.3;
const EXPLAINED_M_S2: f32 = 0.2;
/// Minimum unexplained push that counts as an error of the estimate while the hands hold an object: 17 N on a
/// G1.
const UNEXPLAINED_M_S2: f32 = 0.5;

/// Estimate of how far a robot yields; see the module's text.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(in crate::locomotion::balance) struct Partner {
    /// Degree to which fingers press on an object, 0 to 1.
    hold_share: f32,
    /// Time for which the pull has been strong.
    strong_s: f32,
    strong: bool,
    /// Degree to which the pull is attributed to the world, 0 to 1.
    world_share: f32,
}

impl Partner {
    /// Splits the push observed in one physics step on a robot of `mass_kg`, load included.
    pub(in crate::locomotion::balance) fn split(
        &mut self,
        body: &BodyEstimate,
        push: ObservedPush,
        mass_kg: f32,
        dt_s: f32,
    ) -> SplitPush {
        let felt_m_s2 = flat(body.hand_reaction_n.left + body.hand_reaction_n.right) / mass_kg;
        let hands_m_s2 = explained_m_s2(push.acceleration_m_s2, felt_m_s2) * self.hold_share;
        self.update(body, hands_m_s2.length(), dt_s);
        let yield_share = self.hold_share * (1.0 - self.world_share);
        let rest_m_s2 = push.acceleration_m_s2 - hands_m_s2;
        let rest_m_s2 = rest_m_s2 - rest_m_s2.clamp_length_max(UNEXPLAINED_M_S2 * yield_share);
        let palms_m = body.palms_m();
        SplitPush {
            rest: ObservedPush { acceleration_m_s2: rest_m_s2, ..push },
            hands_m_s2: hands_m_s2 * (1.0 - yield_share),
            hands_lever_m: (palms_m.left.z + palms_m.right.z) * 0.5 - body.com_m.z,
            yield_share,
        }
    }

    fn update(&mut self, body: &BodyEstimate, pull_m_s2: f32, dt_s: f32) {
        let presses = body.hand_presses.left || body.hand_presses.right;
        let change_1_s = if presses { BEGINS_1_S } else { -ENDS_1_S };
        self.hold_share = (self.hold_share + change_1_s * dt_s).clamp(0.0, 1.0);
        self.strong_s = if pull_m_s2 > STRONG_M_S2 { self.strong_s + dt_s } else { 0.0 };
        self.strong = self.strong_s > body.model.scale.time_s(STRONG_S)
            || self.strong && pull_m_s2 > STRONG_M_S2 * STILL_STRONG;
        let change_1_s = if self.strong { WITHSTANDS_1_S } else { -GIVES_WAY_1_S };
        self.world_share = (self.world_share + change_1_s * dt_s).clamp(0.0, 1.0);
    }
}

/// Returns the part of a push that comes through the hands. It has the direction of the sensed force and is
/// not much larger.
fn explained_m_s2(push_m_s2: Vector, felt_m_s2: Vector) -> Vector {
    let along = felt_m_s2.normalize_or_zero();
    let most_m_s2 = felt_m_s2.length() * EXPLAINED_SHARE + EXPLAINED_M_S2;
    along * push_m_s2.dot(along).clamp(0.0, most_m_s2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sides;
    use crate::body::posed::Posed;

    const DT_S: f32 = 1.0 / 200.0;

    /// Splits a forward push that lasts for some seconds. The hands sense the part `felt_m_s2`.
    fn split(
        partner: &mut Partner,
        presses: bool,
        push_m_s2: f32,
        felt_m_s2: f32,
        seconds: f32,
    ) -> SplitPush {
        let body = Posed::standing().body();
        let mass_kg = body.model.mass_kg;
        let felt_n = Sides { left: Vector::X * felt_m_s2 * mass_kg, right: Vector::ZERO };
        let hand_presses = Sides { left: presses, right: false };
        let body = BodyEstimate { hand_presses, hand_reaction_n: felt_n, ..body };
        let push = ObservedPush { acceleration_m_s2: Vector::X * push_m_s2, ..ObservedPush::default() };
        let steps = (seconds / DT_S) as usize;
        (0..steps).map(|_| partner.split(&body, push, mass_kg, DT_S)).last().expect("at least one step")
    }

    #[test]
    fn a_robot_that_holds_something_gives_way_to_what_its_hands_feel() {
        let mut partner = Partner::default();
        let push = split(&mut partner, false, 0.9, 0.9, 2.0);
        assert_eq!((push.rest.acceleration_m_s2.x, push.hands_m_s2.x, push.yield_share), (0.9, 0.0, 0.0));
        let push = split(&mut partner, true, 0.9, 0.8, 1.0);
        assert_eq!((push.rest.acceleration_m_s2.x, push.hands_m_s2.x, push.yield_share), (0.0, 0.0, 1.0));
        let push = split(&mut partner, false, 0.9, 0.8, 0.2);
        assert!(push.yield_share > 0.7, "a finger has slipped: {}", push.yield_share);
    }

    #[test]
    fn a_shove_that_hands_do_not_feel_is_withstood() {
        let mut partner = Partner::default();
        split(&mut partner, true, 0.0, 0.0, 1.0);
        let push = split(&mut partner, true, 1.5, 0.0, 0.1);
        let rest_m_s2 = push.rest.acceleration_m_s2.x;
        assert!((rest_m_s2 - (1.5 - UNEXPLAINED_M_S2)).abs() < 1e-5, "{rest_m_s2}");
    }

    #[test]
    fn a_pull_that_feet_cannot_hold_is_the_worlds_until_it_is_half() {
        let mut partner = Partner::default();
        assert_eq!(split(&mut partner, true, 1.3, 1.2, 1.0).yield_share, 0.0);
        let push = split(&mut partner, true, 1.3, 1.2, 0.1);
        assert!((push.hands_m_s2.x - 1.3).abs() < 1e-5, "{}", push.hands_m_s2.x);
        assert_eq!(split(&mut partner, true, 0.7, 0.7, 2.0).yield_share, 0.0, "it has not ended yet");
        assert_eq!(split(&mut partner, true, 0.4, 0.4, 1.1).yield_share, 1.0);
    }
}
