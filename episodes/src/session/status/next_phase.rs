//! Explanation of the next phase: the parts of its conditions that do not hold.

use tandem_tools_spec::NextPhase;

use super::super::Session;
use crate::conditions::ConditionPart;
use crate::scoring::{Facts, Phase, PhaseMemory, Predicate};
use crate::tasks::{PhaseCondition, PhaseSetting, Task};

const KEPT_BACK: &str =
    "the rest depends on what the seed has chosen for this episode, which only the instructions say";

impl Session {
    /// Returns the next phase and what it lacks. `None` after the last phase, or if phases are not disclosed.
    pub(in crate::session) fn next_phase(&self) -> Option<NextPhase> {
        if !self.spec().disclosure.tells(self.ended.is_some()) {
            return None;
        }
        let (task, index) = (&self.spec().task, self.scores.reached().count());
        let phase = task.phases.get(index)?;
        let lacks = lacks(task, index, self.scores.next_phase(), &self.facts());
        Some(NextPhase { id: phase.id.clone(), number: Phase::number(index), lacks })
    }
}

/// Returns what phase number `index` of a task lacks, one sentence each.
fn lacks(task: &Task, index: usize, memory: &PhaseMemory, facts: &Facts) -> Vec<String> {
    let conditions = &task.conditions[index];
    let told = |number: usize| told_parts(task, index, number);
    let missing = |number: usize| told(number).flat_map(|part| part.lacks(facts)).collect::<Vec<_>>();
    let keeps_back = |number: usize| told(number).count() < conditions[number].parts.len();
    // The duration would reveal whether withheld parts of the condition hold.
    let lasts = |number: usize, since_s: Option<f64>| {
        let PhaseCondition { for_s, truth, .. } = &conditions[number];
        let told = (!keeps_back(number)).then(|| lasting(*for_s, since_s, truth.holds(facts), facts));
        told.flatten()
    };
    let mut found = Vec::new();
    let mut milestones = 0;
    for (number, condition) in conditions.iter().enumerate() {
        match condition.setting {
            PhaseSetting::Done => found.extend(missing(number)),
            PhaseSetting::First if memory.underway() => {}
            PhaseSetting::First => found.extend(after("first", missing(number))),
            PhaseSetting::Then => found.extend(after("then", missing(number))),
            PhaseSetting::Lasting => {
                found.extend(missing(number));
                found.extend(lasts(number, memory.since_s()));
            }
            PhaseSetting::AtEnd => found.extend(after("at the end of that", missing(number))),
            PhaseSetting::Milestone => {
                let (since_s, passed) = memory.milestone(milestones);
                milestones += 1;
                if !passed {
                    found.extend(missing(number));
                    found.extend(lasts(number, since_s));
                }
            }
            PhaseSetting::Spoiled if memory.spoiled() => {
                found.push("it can no longer be reached: what its description forbids has happened".into());
            }
            PhaseSetting::Broken | PhaseSetting::Spoiled => {}
        }
    }
    if (0..conditions.len()).any(keeps_back) {
        found.push(KEPT_BACK.into());
    }
    found
}

/// Returns the parts of a condition that do not depend on the seed's choice. An operator of a robot may
/// read no others.
fn told_parts(task: &Task, phase: usize, condition: usize) -> impl Iterator<Item = &ConditionPart> {
    let same = move |number: usize, part: &ConditionPart| {
        let variants = task.variants().iter();
        let mut others = variants.map(|variant| variant.conditions[phase][condition].parts.get(number));
        others.all(|other| other.is_some_and(|(_, other)| other.asks_the_same(part)))
    };
    let numbered = task.conditions[phase][condition].parts.iter().map(|(_, part)| part).enumerate();
    numbered.filter(move |(number, part)| same(*number, part)).map(|(_, part)| part)
}

fn after(when: &str, lacks: Vec<String>) -> impl Iterator<Item = String> {
    lacks.into_iter().map(move |lack| format!("{when}: {lack}"))
}

/// Returns the remaining duration for which a condition must hold without interruption.
fn lasting(for_s: f64, since_s: Option<f64>, holds: bool, facts: &Facts) -> Option<String> {
    let held_s = since_s.filter(|_| holds).map_or(0.0, |since_s| facts.time_s - since_s);
    (for_s > 0.0).then(|| format!("that has to hold for {for_s} s without a break: so far {held_s:.2} s"))
}

#[cfg(test)]
mod tests {
    use tandem_sim::{Side::Right, Vector};

    use super::*;
    use crate::scoring::Grip::{Holding, Touching};
    use crate::scoring::{A, B};
    use crate::tasks::{self, TaskSet};

    fn lacking(id: &str, phase: usize, change: impl Fn(Facts) -> Facts) -> Vec<String> {
        let task = tasks::find(id).unwrap();
        lacks(&task, phase, &PhaseMemory::default(), &change(Facts::at_rest(&task)))
    }

    #[test]
    fn what_a_phase_lacks_is_said_part_by_part() {
        assert_eq!(
            lacking("handover", 0, |facts| facts.grip(A, Right, "bottle", Touching)),
            [
                "A's right hand does not hold bottle: the right one touches it from one side alone",
                "lift_m(\"bottle\") >= 0.03: it is 0",
            ]
        );
        let aloft = |facts: Facts| facts.grip(A, Right, "bottle", Holding).raised("bottle", 0.04);
        assert!(lacking("handover", 0, aloft).is_empty());
        let placed = lacking("handover", 2, |facts| {
            let mut facts = facts.grip(B, Right, "bottle", Touching).turned("bottle", Vector::X, 0.3);
            let target_m = facts.position_m("target_pad");
            let bottle = facts.object_mut("bottle");
            bottle.pose_in_world.translation = target_m + Vector::new(0.0, 0.2, 0.01);
            bottle.velocity_m_s = Vector::X * 0.06;
            facts
        });
        assert_eq!(
            placed,
            [
                "B's right hand is still on bottle",
                "bottle leans by 17.2 degrees, at most 15.0",
                "bottle moves at 0.06 m/s, at most 0.05",
                "bottle is 0.200 m along y from target_pad, at most 0.06",
            ]
        );
    }

    #[test]
    fn sequences_and_what_has_to_last_say_what_comes_first() {
        let transfer = lacking("handover", 1, |facts| facts);
        assert!(transfer[0].starts_with("first: A's right hand does not hold bottle"), "{transfer:?}");
        assert!(transfer.iter().any(|lack| lack.starts_with("then: B's right hand")), "{transfer:?}");
        let opened = lacking("move_house", 0, |facts| facts.turned("lever_door leaf", Vector::Z, 1.5));
        let last = opened.last().map(String::as_str);
        assert_eq!(last, Some("that has to hold for 0.5 s without a break: so far 0.00 s"), "{opened:?}");
        let facts = Facts::at_rest(&tasks::find("pouring").unwrap());
        let held = lasting(0.5, Some(facts.time_s - 0.2), true, &facts).unwrap();
        assert!(held.ends_with("so far 0.20 s"), "{held}");
    }

    /// Only A knows the pad for the bottle, but C also reads what the phase lacks.
    #[test]
    fn what_the_seed_chooses_is_kept_back() {
        let set = TaskSet::default();
        let relay = set.find("relay").unwrap();
        for seed in 0..6 {
            let task = relay.under(seed);
            let place = lacks(&task, 2, &PhaseMemory::default(), &Facts::at_rest(&task));
            assert_eq!(place, [KEPT_BACK]);
            let passed = lacks(&task, 0, &PhaseMemory::default(), &Facts::at_rest(&task));
            assert!(!passed.contains(&KEPT_BACK.to_owned()) && passed.len() > 2, "{passed:?}");
        }
    }
}
