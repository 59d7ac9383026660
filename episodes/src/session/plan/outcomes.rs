//! Outcomes of a plan's commands, one line each.

use std::collections::BTreeSet;

use tandem_sim::Side;
use tandem_tools_spec::{BaseState, CommandReply, Grip, HandReport, HandState, RobotReport};

/// Outcomes of the commands that have been begun, in their order.
#[derive(Debug, Default)]
pub struct Outcomes(Vec<PlanOutcome>);

/// A command with its pieces so far.
#[derive(Debug)]
struct PlanOutcome {
    place: String,
    steps: u32,
    /// Robots that have walked during it.
    walked: BTreeSet<String>,
    /// States of its robots at its end.
    states: String,
}

/// Displacement of a pelvis in one piece above which its robot has walked.
const MIN_WALKED_M: f64 = 0.02;

impl Outcomes {
    /// Adds the reply to a command, or to a further piece of the last one. A wrist that `is_under_way` has
    /// not received its last target.
    pub fn add(&mut self, place: &str, reply: &CommandReply, is_under_way: impl Fn(&str, Side) -> bool) {
        if self.0.last().is_none_or(|last| last.place != place) {
            let (place, walked) = (place.into(), BTreeSet::new());
            self.0.push(PlanOutcome { place, steps: 0, walked, states: String::new() });
        }
        if let Some(outcome) = self.0.last_mut() {
            outcome.add(reply, is_under_way);
        }
    }

    /// Returns a line for each command, for example "1. 25 steps: A left arrived, right blocked 0.031 m off";
    /// none for a single command.
    pub fn lines(self) -> Vec<String> {
        let Outcomes(outcomes) = self;
        if outcomes.len() < 2 {
            return Vec::new();
        }
        let line = |(index, PlanOutcome { steps, states, .. }): (usize, PlanOutcome)| {
            let states = if states.is_empty() { states } else { format!(": {states}") };
            format!("{}. {steps} steps{states}", index + 1)
        };
        outcomes.into_iter().enumerate().map(line).collect()
    }
}

impl PlanOutcome {
    fn add(&mut self, reply: &CommandReply, is_under_way: impl Fn(&str, Side) -> bool) {
        self.steps += reply.executed_steps;
        let has_walked = |report: &&RobotReport| {
            let moved_m = report.base_motion.map_or(0.0, |motion| motion.forward_m.hypot(motion.left_m));
            moved_m > MIN_WALKED_M
        };
        self.walked.extend(reply.robots.iter().filter(has_walked).map(|report| report.robot.clone()));
        let states = reply.robots.iter().filter_map(|report| self.state(report, &is_under_way));
        self.states = states.collect::<Vec<String>>().join("; ");
    }

    /// Describes a robot; `None` if it has not moved, and its hands have no target and feel no contact.
    fn state(&self, report: &RobotReport, is_under_way: impl Fn(&str, Side) -> bool) -> Option<String> {
        let hands = [(Side::Left, &report.left), (Side::Right, &report.right)];
        let hands = hands
            .into_iter()
            .filter_map(|(side, hand)| hand_state(side.name(), hand, is_under_way(&report.robot, side)));
        let base = report.base.and_then(|base| base.state).and_then(base_state);
        let in_room = report.pelvis_in_room.map(|pose| (pose, "room"));
        let pelvis = in_room.or(report.pelvis_in_start.map(|pose| (pose, "start")));
        let pelvis = pelvis.filter(|_| self.walked.contains(&report.robot)).map(|(pose, frame)| {
            let [x_m, y_m, _] = pose.position_m;
            format!("pelvis at [{x_m:.2}, {y_m:.2}] m in {frame}")
        });
        let parts: Vec<String> = hands.chain(base.map(str::to_owned)).chain(pelvis).collect();
        (!parts.is_empty()).then(|| format!("{} {}", report.robot, parts.join(", ")))
    }
}

/// Describes a hand: its wrist if that has a target, and its grip if it senses one. `None` without either.
fn hand_state(side: &str, hand: &HandReport, is_under_way: bool) -> Option<String> {
    let grip = match hand.grip {
        Some(Grip::TwoSided) => Some("grip two_sided"),
        Some(Grip::OneSided) => Some("grip one_sided"),
        Some(Grip::Touching) => Some("grip touching"),
        Some(Grip::None) | None => None,
    };
    let state = match hand.state? {
        HandState::Idle => None,
        HandState::Arrived => Some(if is_under_way { "on its way" } else { "arrived" }),
        HandState::Moving => Some("moving"),
        HandState::Blocked => Some("blocked"),
        HandState::OutOfReach => Some("out_of_reach"),
    };
    let is_off = !matches!(hand.state, Some(HandState::Arrived | HandState::Idle));
    let off = hand.position_error_m.filter(|_| is_off).map(|off_m| format!("{off_m:.3} m off"));
    let parts = [state.map(str::to_owned), off, grip.map(str::to_owned)];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| format!("{side} {}", parts.join(" ")))
}

fn base_state(state: BaseState) -> Option<&'static str> {
    match state {
        BaseState::Standing => None,
        BaseState::Stepping => Some("stepping"),
        BaseState::Settling => Some("settling"),
        BaseState::Pushed => Some("pushed"),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    #[test]
    fn a_hand_says_what_it_grips_with_a_target_or_without() {
        let check = |hand: Value, expected: Option<&str>| {
            let hand = serde_json::from_value(hand).unwrap();
            assert_eq!(hand_state("left", &hand, false).as_deref(), expected);
        };
        let still = |grip: &str| json!({ "state": HandState::Idle, "grip": grip, "position_error_m": 0.02 });
        check(still("none"), None);
        check(still("two_sided"), Some("left grip two_sided"));
        check(json!({ "state": "arrived", "grip": "none", "position_error_m": 0.004 }), Some("left arrived"));
        check(
            json!({ "state": "blocked", "grip": "touching", "position_error_m": 0.031 }),
            Some("left blocked 0.031 m off grip touching"),
        );
        let hand = serde_json::from_value(json!({ "state": "arrived", "grip": "none" })).unwrap();
        assert_eq!(hand_state("left", &hand, true).as_deref(), Some("left on its way"));
    }
}
