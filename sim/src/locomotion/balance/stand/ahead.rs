//! Whether a robot that stands leans ahead of pulls: against what a pull that grows will be, before it is there.
//!
//! A pull from the world is there whatever the robot does. What its hands hold may answer to the lean: of two robots that hold
//! one load each feels the other's lean as a pull that grows. If both lean away by x, a load of the stiffness k between them
//! pulls with 2 k x at the height z, and against that both lean by  2 k x z / (m g),  which is more than x from
//! k = 200 N/m on; a lead makes that gain greater still. So a robot leans ahead with empty hands only.

use serde::{Deserialize, Serialize};

use crate::body::BodyEstimate;
use crate::locomotion::BaseCommand;

/// A hand that closes on a load drags it, and is dragged: the robot leans ahead of that while the fingers close, and less and less
/// for two seconds. What is held then is a load that answers. A hand that opens lets it come back within a second.
const ENDS_1_S: f32 = 0.5;
const BEGINS_1_S: f32 = 1.0;
/// A robot told to stand lower bends down to something.
const LOWEST_M: f32 = 0.70;

/// How much a robot leans ahead of pulls, 0 to 1; see the module's text.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(in crate::locomotion::balance) struct Ahead {
    part: f32,
    free: bool,
}

impl Ahead {
    pub(in crate::locomotion::balance) fn part(&self) -> f32 {
        self.part
    }

    /// The hands hold nothing and the robot is not to bend down.
    pub(in crate::locomotion::balance) fn is_free(&self) -> bool {
        self.free
    }

    pub(in crate::locomotion::balance) fn update(
        &mut self,
        body: &BodyEstimate,
        command: &BaseCommand,
        dt_s: f32,
    ) {
        let holds = body.hand_holds.left || body.hand_holds.right;
        self.free = !holds && command.pelvis_height_m > LOWEST_M;
        let change = if self.free { BEGINS_1_S } else { -ENDS_1_S };
        self.part = (self.part + change * dt_s).clamp(0.0, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sides;
    use crate::body::posed::Posed;

    const DT_S: f32 = 1.0 / 200.0;
    const ENDED_S: f32 = 1.1 / ENDS_1_S;

    /// What is left of leaning ahead after so long with this command, a hand holding something or none.
    fn part_after(ahead: &mut Ahead, seconds: f32, holds: bool, height_m: f32) -> f32 {
        let mut body = Posed::standing().body();
        body.hand_holds = Sides { left: false, right: holds };
        for _ in 0..(seconds / DT_S) as usize {
            ahead.update(&body, &BaseCommand::standing(height_m), DT_S);
        }
        ahead.part()
    }

    #[test]
    fn a_robot_leans_ahead_with_empty_hands_and_upright_alone() {
        let mut ahead = Ahead::default();
        assert_eq!(part_after(&mut ahead, 1.1, false, 0.76), 1.0);
        for (holds, height_m) in [(true, 0.76), (false, 0.6)] {
            assert!(part_after(&mut ahead, 0.02, holds, height_m) > 0.5, "it ends with a jerk");
            assert_eq!(part_after(&mut ahead, ENDED_S, holds, height_m), 0.0);
            assert!(!ahead.is_free());
            let part = part_after(&mut ahead, 0.5, false, 0.76);
            assert!((part - 0.5).abs() < 0.02, "{part} half a second after a hand has opened");
            assert_eq!(part_after(&mut ahead, 1.0, false, 0.76), 1.0);
        }
    }
}
