//! Conditions of plans on the reply to a command.

use std::collections::BTreeSet;

use tandem_tools_spec::{
    BaseState, CommandReply, Expectation, Grip, HandReport, HandState, Partner, PartnerDid, RobotReport,
    Tool as _, Touch, Wait,
};

use crate::scoring::Phase;

/// News from other operators while a plan runs.
#[derive(Debug, Default)]
pub struct PartnerNews {
    /// Robots whose operators have sent a message.
    pub heard: BTreeSet<String>,
    /// True if every partner waited during the last command.
    pub partners_wait: bool,
}

impl PartnerNews {
    /// Returns the operators that have sent a message, as a reason to end the plan; `None` if there are none.
    pub fn words(&self) -> Option<String> {
        let speakers: Vec<&str> = self.heard.iter().map(String::as_str).collect();
        (!speakers.is_empty()).then(|| format!("{} has spoken", speakers.join(" and ")))
    }
}

/// Returns true if every partner waits for the others, by `wait` or because it has finished. A partner that
/// has been silent for too long counts as thinking.
pub fn all_wait(partners: &[Partner]) -> bool {
    let waits = |partner: &Partner| match partner.did {
        PartnerDid::Acted => partner.tool.as_deref() == Some(Wait::NAME),
        PartnerDid::HeldFinished => true,
        PartnerDid::HeldSilent => false,
    };
    !partners.is_empty() && partners.iter().all(waits)
}

/// State of a plan after a command, beside the command's reply.
#[derive(Debug, Clone, Copy)]
pub struct PlanMoment<'a> {
    pub news: &'a PartnerNews,
    /// True once wrists have their last targets. A wrist that reaches its target earlier has only reached an
    /// intermediate target.
    pub is_way_done: bool,
    /// True once fingers have their last targets.
    pub are_fingers_done: bool,
}

/// Returns the first condition of `expected` that does not hold after a command, in words; `None` if all
/// hold.
pub fn unexpected(expected: &Expectation, reply: &CommandReply, moment: PlanMoment) -> Option<String> {
    let hands: Vec<(String, &HandReport)> = reply.robots.iter().flat_map(hands_of).collect();
    let find = |is: fn(&HandReport) -> bool| hands.iter().find(|(_, hand)| is(hand));
    let under_way = find(|hand| !matches!(hand.state, Some(HandState::Arrived | HandState::Idle)));
    let stopped = find(|hand| matches!(hand.state, Some(HandState::Blocked | HandState::OutOfReach)));
    let touches = find(|hand| !hand.presses.is_empty() || hand.touches == Some(Touch::Something));
    let holds = find(|hand| hand.grip == Some(Grip::TwoSided));
    let steps = reply.robots.iter().find(|robot| {
        robot.base.and_then(|base| base.state).is_some_and(|state| state != BaseState::Standing)
    });
    let off = |(name, hand): &(String, &HandReport)| {
        format!("{name} is {:.3} m off", hand.position_error_m.unwrap_or_default())
    };
    let name = |(name, _): &(String, &HandReport)| name.clone();
    let has_arrived = under_way.is_none() && moment.is_way_done;
    differs("arrived", expected.arrived, has_arrived, under_way.map(off))
        .or_else(|| differs("blocked", expected.blocked, stopped.is_some(), stopped.map(off)))
        .or_else(|| differs("touching", expected.touching, touches.is_some(), touches.map(name)))
        .or_else(|| {
            // An object in closing fingers may still slip out; one in opening fingers is held.
            let is_held = holds.is_some() && (moment.are_fingers_done || expected.holding == Some(false));
            differs("holding", expected.holding, is_held, holds.map(name))
        })
        .or_else(|| {
            let robot = steps.map(|robot| robot.robot.clone());
            differs("base_stepping", expected.base_stepping, steps.is_some(), robot)
        })
        .or_else(|| differs("heard", expected.heard, !moment.news.heard.is_empty(), None))
        .or_else(|| unheard(expected.heard_from.as_deref()?, moment.news))
        .or_else(|| differs("partners_wait", expected.partners_wait, moment.news.partners_wait, None))
        .or_else(|| force_differs(expected, &hands))
        .or_else(|| phase_missing(expected, reply))
        .or_else(|| none_holds(expected.any_of.as_deref()?, reply, moment))
}

/// Returns the reasons why none of the alternatives holds; `None` if one of them holds.
fn none_holds(any_of: &[Expectation], reply: &CommandReply, moment: PlanMoment) -> Option<String> {
    let lacks: Option<Vec<String>> = any_of.iter().map(|one| unexpected(one, reply, moment)).collect();
    lacks.map(|lacks| format!("none of any_of holds: {}", lacks.join("; ")))
}

fn differs(name: &str, wanted: Option<bool>, is: bool, which: Option<String>) -> Option<String> {
    let wanted = wanted.filter(|wanted| *wanted != is)?;
    Some(format!(
        "{name} is {is}, not {wanted}{}",
        which.map(|which| format!(" ({which})")).unwrap_or_default()
    ))
}

fn unheard(from: &str, news: &PartnerNews) -> Option<String> {
    (!news.heard.contains(from)).then(|| format!("{from} has not spoken"))
}

fn force_differs(expected: &Expectation, hands: &[(String, &HandReport)]) -> Option<String> {
    let force_n = |hand: &HandReport| {
        hand.force_n.map_or(0.0, |force_n| force_n.iter().map(|part| part * part).sum::<f64>().sqrt())
    };
    let max_n = hands.iter().map(|(_, hand)| force_n(hand)).fold(0.0, f64::max);
    let above = expected.force_above_n.filter(|least_n| max_n <= *least_n);
    let below = expected.force_below_n.filter(|limit_n| max_n > *limit_n);
    above
        .map(|least_n| format!("hands feel {max_n:.1} N at most, not above {least_n}"))
        .or_else(|| below.map(|limit_n| format!("a hand feels {max_n:.1} N, above {limit_n}")))
}

fn phase_missing(expected: &Expectation, reply: &CommandReply) -> Option<String> {
    let phase = expected.phase_reached.as_ref()?;
    let is_reached = reply.phases.iter().any(|reached| reached.number == *phase || reached.id == *phase);
    let next = Phase::number(reply.phases.len());
    let lacking = if *phase == next { "it".into() } else { format!("{next}, the next phase,") };
    (!is_reached)
        .then(|| format!("{phase} has not been reached; get_status with explain says what {lacking} lacks"))
}

/// Returns both hands of a robot with their names.
fn hands_of(report: &RobotReport) -> [(String, &HandReport); 2] {
    [
        (format!("{}'s left wrist", report.robot), &report.left),
        (format!("{}'s right wrist", report.robot), &report.right),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partners_wait_who_let_time_pass() {
        let partner = |did, tool: Option<&str>| {
            let tool = tool.map(str::to_owned);
            Partner { robot: "B".into(), did, tool }
        };
        let waits = partner(PartnerDid::Acted, Some("wait"));
        let is_done = partner(PartnerDid::HeldFinished, None);
        assert!(all_wait(&[waits.clone(), is_done]));
        assert!(!all_wait(&[waits, partner(PartnerDid::Acted, Some("walk"))]));
        assert!(!all_wait(&[partner(PartnerDid::HeldSilent, None)]), "it thinks");
        assert!(!all_wait(&[]), "there is nobody");
    }

    /// Fingers that are stopped half-way hold an object loosely, and it slips.
    #[test]
    fn closing_fingers_hold_once_they_are_done() {
        let reply: CommandReply = serde_json::from_value(serde_json::json!({
            "executed_steps": 5, "stop_reason": "steps_done", "time_s": 1.0, "phases": [],
            "robots": [{ "robot": "A", "left": { "grip": "two_sided" }, "right": {} }],
            "budget": { "steps_left": 5, "steps_per_command": 25 },
        }))
        .unwrap();
        let news = PartnerNews::default();
        let lacks = |holding: bool, are_fingers_done: bool| {
            let expected = Expectation { holding: Some(holding), ..Expectation::default() };
            unexpected(&expected, &reply, PlanMoment { news: &news, is_way_done: true, are_fingers_done })
        };
        assert_eq!((lacks(true, true), lacks(true, false).is_some()), (None, true));
        assert!(lacks(false, true).is_some() && lacks(false, false).is_some(), "opening fingers still hold");
    }
}
