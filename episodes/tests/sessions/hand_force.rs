//! What hands feel while an expert works.

use crate::common::*;
use tandem_episodes::players::{self, Backstage, Caller, PlayerError};
use tandem_episodes::{A, B, Facts, Session};
use tandem_sim::{Side, Sides, Vector};
use tandem_tools_spec::{HandReport, HandState, Protocol, ToolCall, ToolReply};

/// Plays on, and notes the hand forces whenever A alone holds the bottle in the air.
struct Lifting {
    session: Session,
    /// By the robots' hands at each of these moments.
    felt_n: Vec<Vec<Sides<Vector>>>,
    /// What A's replies say of its right hand then.
    told: Vec<HandReport>,
}

impl Caller for Lifting {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let reply = self.session.call(call).map_err(|_| PlayerError::EpisodeOver)?;
        let facts = self.session.facts();
        let by_a_alone = facts.holds(A, Side::Right, "bottle") && facts.hands_off(B, "bottle");
        if by_a_alone && facts.lift_m("bottle") > 0.03 {
            self.felt_n.push(facts.robots.iter().map(|robot| robot.hand_force_n).collect());
            if let ToolReply::Act(reply) = &reply {
                self.told.extend(
                    reply.robots.iter().filter(|robot| robot.robot == "A").map(|robot| robot.right.clone()),
                );
            }
        }
        Ok(reply)
    }
}

impl Backstage for Lifting {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        Ok(self.session.facts())
    }
}

/// Forces are estimated from the arm's torques alone, so the bottle's weight has to show where it is held, and only there.
#[test]
fn a_hand_that_lifts_the_bottle_feels_its_weight() {
    const BOTTLE_N: f32 = 0.5 * 9.81;
    let mut lifting = Lifting { session: handover(1), felt_n: Vec::new(), told: Vec::new() };
    let spec = spec("handover", 1, Protocol::Benchmark);
    players::find("expert").unwrap().play(&spec, &mut lifting).unwrap();
    assert!(lifting.felt_n.len() >= 5, "A held the bottle after {} commands", lifting.felt_n.len());
    for felt_n in &lifting.felt_n {
        let Sides { left: left_n, right: right_n } = felt_n[A];
        assert!((right_n.z + BOTTLE_N).abs() < 0.15 * BOTTLE_N, "the right hand feels {right_n} N");
        assert!(left_n.z.abs() < 0.1 * BOTTLE_N, "the left hand feels {left_n} N");
    }
    assert!(lifting.told.len() >= 5, "A was told of its hand {} times", lifting.told.len());
    for right in &lifting.told {
        assert!((right.force_n[2] + f64::from(BOTTLE_N)).abs() < 0.75, "{right:?}");
        assert_eq!(right.fingers.state, HandState::Blocked, "the bottle is between them: {right:?}");
    }
    // Later B moves its arms, and their inertia shows.
    for force_n in lifting.felt_n[0][B] {
        assert!(force_n.length() < 0.05, "B's hands touch nothing and feel {force_n} N");
    }
}
