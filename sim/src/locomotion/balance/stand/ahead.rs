//! Leaning ahead of pulls: a standing robot leans against the predicted size of a growing pull before it
//! is reached.
//!
//! A pull from the world does not depend on the robot's motion. A held object may react to the lean: if two
//! robots hold one load, each senses its partner's lean as a growing pull. If both lean away by x, a load of
//! the stiffness k between them pulls with 2 k x at the height z. Against that both lean by 2 k x z / (m g),
//! which is more than x from k = 200 N/m on; a lead increases that gain further. If a hand's own motion
//! brings it against an obstacle, such as a counter or the wall of a bin, the obstacle pushes back: the robot
//! would lean into it, and the hand would slide away. Therefore a robot leans ahead only with hands that are
//! still, empty and free of contact.

use serde::{Deserialize, Serialize};

use crate::body::BodyEstimate;
use crate::locomotion::BaseCommand;

const BEGINS_1_S: f32 = 1.0;
const ENDS_1_S: f32 = 5.0;
/// Pelvis height below which a command means bending down to an object.
const LOWEST_M: f32 = 0.70;
/// Time after the last command until arms and fingers have come to rest.
const STILL_S: f32 = 0.5;
/// Force (N) above which a moving hand has met an obstacle, and (`LEFT_N`) below which it no longer touches
/// one.
const MET_N: f32 = 8.0;
const LEFT_N: f32 = 6.0;

/// Degree to which a robot leans ahead of pulls, 0 to 1; see the module's text.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(in crate::locomotion::balance) struct Ahead {
    share: f32,
    free: bool,
    /// Time since arms and fingers were last commanded to move.
    still_s: f32,
    /// True if a hand has met an obstacle by its own motion.
    met: bool,
}

impl Ahead {
    pub(in crate::locomotion::balance) fn share(&self) -> f32 {
        self.share
    }

    /// Returns true if the hands are still, empty and free of contact, and the robot is not commanded to bend
    /// down.
    pub(in crate::locomotion::balance) fn is_free(&self) -> bool {
        self.free
    }

    pub(in crate::locomotion::balance) fn update(
        &mut self,
        body: &BodyEstimate,
        command: &BaseCommand,
        dt_s: f32,
    ) {
        let scale = &body.model.scale;
        self.still_s = if body.arms_told { 0.0 } else { self.still_s + dt_s };
        let moves = self.still_s < scale.time_s(STILL_S);
        let felt_n = body.hand_reaction_n.iter().map(|felt_n| felt_n.length()).fold(0.0, f32::max);
        self.met = (moves && felt_n > scale.force_n(MET_N)) || (self.met && felt_n > scale.force_n(LEFT_N));
        let holds = body.hand_holds.left || body.hand_holds.right;
        self.free = !(moves || self.met || holds) && command.pelvis_height_m > scale.height_m(LOWEST_M);
        let change_1_s = if self.free { BEGINS_1_S } else { -ENDS_1_S };
        self.share = (self.share + change_1_s * dt_s).clamp(0.0, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use rapier3d::math::Vector;

    use super::*;
    use crate::Sides;
    use crate::body::posed::Posed;

    const DT_S: f32 = 1.0 / 200.0;
    const UPRIGHT_M: f32 = 0.76;
    /// Time until still arms count as still and the robot leans ahead fully.
    const BEGUN_S: f32 = STILL_S + 1.1 / BEGINS_1_S;

    impl Ahead {
        /// Returns the share of leaning ahead after this time with this body.
        fn share_after(&mut self, body: &BodyEstimate, height_m: f32, seconds: f32) -> f32 {
            for _ in 0..(seconds / DT_S) as usize {
                self.update(body, &BaseCommand::standing(height_m), DT_S);
            }
            self.share()
        }
    }

    fn begun() -> Ahead {
        let mut ahead = Ahead::default();
        assert_eq!(ahead.share_after(&Posed::standing().body(), UPRIGHT_M, BEGUN_S), 1.0);
        ahead
    }

    #[test]
    fn a_robot_leans_ahead_with_still_and_empty_hands_and_upright_alone() {
        let holds =
            |body: BodyEstimate| BodyEstimate { hand_holds: Sides { left: false, right: true }, ..body };
        let told = |body: BodyEstimate| BodyEstimate { arms_told: true, ..body };
        for (change, height_m) in
            [(holds as fn(BodyEstimate) -> BodyEstimate, UPRIGHT_M), (told, UPRIGHT_M), (|body| body, 0.6)]
        {
            let mut ahead = begun();
            let changed = change(Posed::standing().body());
            assert!(ahead.share_after(&changed, height_m, 0.02) > 0.5, "it ends with a jerk");
            assert_eq!(ahead.share_after(&changed, height_m, 1.1 / ENDS_1_S), 0.0);
            assert!(!ahead.is_free());
            assert_eq!(ahead.share_after(&Posed::standing().body(), UPRIGHT_M, BEGUN_S), 1.0);
        }
    }

    #[test]
    fn what_pulls_at_still_hands_is_leant_against_and_what_moving_hands_met_is_not() {
        let pulled = |pull_n: f32| BodyEstimate {
            hand_reaction_n: Sides { left: Vector::X * pull_n, right: Vector::ZERO },
            ..Posed::standing().body()
        };
        assert_eq!(begun().share_after(&pulled(25.0), UPRIGHT_M, 3.0), 1.0);

        let mut ahead = begun();
        let meets = BodyEstimate { arms_told: true, ..pulled(MET_N + 1.0) };
        ahead.share_after(&meets, UPRIGHT_M, 0.1);
        assert_eq!(ahead.share_after(&pulled(LEFT_N + 1.0), UPRIGHT_M, 10.0), 0.0);
        assert_eq!(ahead.share_after(&pulled(LEFT_N - 1.0), UPRIGHT_M, BEGUN_S), 1.0);
    }
}
