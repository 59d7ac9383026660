//! Explanation of the next phase: the parts of its conditions that do not hold.

use tandem_tools_spec::{NextPhase, PoseFrame};

use super::super::Session;
use crate::conditions::ConditionPart;
use crate::scoring::{Facts, Phase, PhaseMemory, Predicate};
use crate::tasks::{PhaseCondition, PhaseSetting, Task, TaskDefinition};

impl Session {
    /// Returns the next phase, its missing conditions and the objects in hands, for the operator of a robot
    /// or for the policy of all robots. `None` after the last phase, or if phases are not disclosed.
    pub(in crate::session) fn next_phase(&self, operator: Option<&str>) -> Option<NextPhase> {
        if !self.spec().disclosure.tells(self.ended.is_some()) {
            return None;
        }
        let (task, index) = (&self.spec().task, self.scores.reached().count());
        let phase = task.phases.get(index)?;
        let alike = alike(task, operator);
        let facts = self.facts();
        Some(NextPhase {
            id: phase.id.clone(),
            number: Phase::number(index),
            lacks: lacks(task, &alike, index, self.scores.next_phase(), &facts),
            held: self.held(&facts, operator, PoseFrame::Level),
        })
    }
}

/// Returns the variants of a task that look the same to a reader. The reader has the instructions of an
/// operator, or those of the policy of all robots.
fn alike<'a>(task: &'a Task, operator: Option<&str>) -> Vec<&'a TaskDefinition> {
    let read = |variant: &TaskDefinition| match operator {
        None => vec![variant.instruction.clone()],
        Some(operator) => {
            let shared = variant.shared_instruction.as_ref().unwrap_or(&variant.instruction);
            let own = variant.robots.iter().filter(|robot| robot.name == operator);
            own.map(|robot| robot.instruction.clone()).chain([shared.clone()]).collect()
        }
    };
    let own = read(task);
    task.variants().iter().filter(|variant| read(variant) == own).collect()
}

/// Returns the missing conditions of phase number `index` of a task, one sentence each. The reader cannot
/// distinguish the task from the variants `alike`.
fn lacks(
    task: &Task,
    alike: &[&TaskDefinition],
    index: usize,
    memory: &PhaseMemory,
    facts: &Facts,
) -> Vec<String> {
    let conditions = &task.conditions[index];
    let others = |number: usize, place: usize| others(alike, index, number, place);
    let is_told = |number: usize, place: usize| {
        let (_, part) = &conditions[number].parts[place];
        others(number, place).iter().all(|other| other.is_some_and(|other| other.asks_the_same(part)))
    };
    // The past state of a condition would reveal its withheld parts, too.
    let missing = |number: usize, has_held: bool| -> Vec<String> {
        let parts = conditions[number].parts.iter().enumerate();
        let sentences = parts.flat_map(|(place, (_, part))| match is_told(number, place) {
            true if has_held => Vec::new(),
            true => part.lacks(facts),
            false => vec![kept_back(&others(number, place))],
        });
        sentences.collect()
    };
    // The duration would reveal whether withheld parts of the condition hold.
    let lasts = |number: usize, since_s: Option<f64>| {
        let PhaseCondition { for_s, truth, parts, .. } = &conditions[number];
        let told = (0..parts.len()).all(|place| is_told(number, place));
        told.then(|| lasting(*for_s, since_s, truth.holds(facts), facts)).flatten()
    };
    let mut found = Vec::new();
    let mut milestones = 0;
    for (number, condition) in conditions.iter().enumerate() {
        match condition.setting {
            PhaseSetting::Done => found.extend(missing(number, false)),
            PhaseSetting::First => found.extend(after("first", missing(number, memory.underway()))),
            PhaseSetting::Then => found.extend(after("then", missing(number, false))),
            PhaseSetting::Lasting => {
                found.extend(missing(number, false));
                found.extend(lasts(number, memory.since_s()));
            }
            PhaseSetting::AtEnd => found.extend(after("at the end of that", missing(number, false))),
            PhaseSetting::Milestone => {
                let (since_s, passed) = memory.milestone(milestones);
                milestones += 1;
                found.extend(missing(number, passed));
                found.extend(lasts(number, since_s).filter(|_| !passed));
            }
            PhaseSetting::Spoiled if memory.spoiled() => {
                found.push("it can no longer be reached: what its description forbids has happened".into());
            }
            PhaseSetting::Broken | PhaseSetting::Spoiled => {}
        }
    }
    found
}

/// Returns the parts of `variants` that correspond to a part of a condition. A condition of the same setting
/// may have other parts in another variant.
fn others<'a>(
    variants: &[&'a TaskDefinition],
    phase: usize,
    condition: usize,
    part: usize,
) -> Vec<Option<&'a ConditionPart>> {
    let conditions = variants.iter().map(|variant| &variant.conditions[phase][condition]);
    conditions.map(|condition| condition.parts.get(part).map(|(_, part)| part)).collect()
}

/// Returns the sentence about a part that differs between the variants which a reader cannot tell apart. It
/// names all of their options, but does not say whether the part holds.
fn kept_back(parts: &[Option<&ConditionPart>]) -> String {
    let mut texts: Vec<&str> = Vec::new();
    for text in parts.iter().flatten().map(|part| part.text.as_str()) {
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    let whole = with_options(&texts);
    format!("{whole}: not told, since your instructions do not say what the seed has chosen")
}

/// Joins texts that differ in one place: "the [red / blue] pad".
fn with_options(texts: &[&str]) -> String {
    let [first, others @ ..] = texts else { return String::new() };
    if others.is_empty() {
        return (*first).into();
    }
    let words: Vec<Vec<&str>> = texts.iter().map(|text| words(text)).collect();
    let shortest = words.iter().map(Vec::len).min().unwrap_or(0);
    let all_have = |place: &dyn Fn(&[&str]) -> usize| {
        words.iter().all(|one| one[place(one)] == words[0][place(&words[0])])
    };
    let begin = (0..shortest).take_while(|word| all_have(&|_| *word)).count();
    let end = (0..shortest - begin).take_while(|word| all_have(&|one| one.len() - 1 - word)).count();
    let options = words.iter().map(|one| one[begin..one.len() - end].concat());
    let [before, after] = [&words[0][..begin], &words[0][words[0].len() - end..]].map(|part| part.concat());
    format!("{before}[{}]{after}", options.collect::<Vec<_>>().join(" / "))
}

/// Splits a text into runs of letters and digits, and the single characters in between.
fn words(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        let run = rest.find(|letter: char| !letter.is_alphanumeric()).unwrap_or(rest.len());
        let (word, after) = rest.split_at(run.max(letter.len_utf8()));
        words.push(word);
        rest = after;
    }
    words
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
        lacks(&task, &alike(&task, None), phase, &PhaseMemory::default(), &change(Facts::at_rest(&task)))
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

    /// Returns the missing conditions of a phase of a tandem+ task at rest, for a reader of its instructions.
    fn at_rest(id: &str, seed: u32, phase: usize, operator: Option<&str>) -> Vec<String> {
        let task = TaskSet::default().find(id).unwrap().under(seed);
        let alike = alike(&task, operator);
        lacks(&task, &alike, phase, &PhaseMemory::default(), &Facts::at_rest(&task))
    }

    /// The pad for the bottle is known only to A and to a policy of all robots.
    #[test]
    fn what_the_seed_chooses_is_told_to_whose_instructions_name_it() {
        let kept_back = "within_box(\"bottle\", \"[red / yellow / blue]_pad\", 0.06): not told, since your \
            instructions do not say what the seed has chosen";
        for seed in 0..6 {
            let task = TaskSet::default().find("relay").unwrap().under(seed);
            let wanted = &task.chosen[0].option;
            for informed in [None, Some("A")] {
                let told = at_rest("relay", seed, 2, informed);
                assert!(told.iter().any(|lack| lack.contains(&format!("from {wanted}_pad"))), "{told:?}");
                assert!(!told.contains(&kept_back.to_owned()), "{told:?}");
            }
            for uninformed in ["B", "C"] {
                assert_eq!(at_rest("relay", seed, 2, Some(uninformed)), [kept_back]);
                let passed = at_rest("relay", seed, 0, Some(uninformed));
                assert!(
                    passed.len() > 2 && passed.iter().all(|lack| !lack.contains("not told")),
                    "{passed:?}"
                );
            }
        }
    }

    /// The facts about an object would reveal to B whether it is the wanted one.
    #[test]
    fn what_is_kept_back_depends_on_nothing_that_the_reader_can_change() {
        let told: Vec<_> = (0..6).map(|seed| at_rest("which_one", seed, 0, Some("B"))).collect();
        assert!(told.iter().all(|lacks| *lacks == told[0] && lacks.len() == 2), "{told:?}");
        assert!(
            told[0][0].starts_with("holds(\"B\", \"right\", \"[red / green / blue]_bottle\"): "),
            "{told:?}"
        );
        // Terms are named without their meaning.
        let count = at_rest("set_the_table", 0, 0, Some("B"));
        assert!(count[0].starts_with("in_place >= 1: not told"), "{count:?}");
        assert_eq!(at_rest("set_the_table", 0, 0, Some("A")), ["in_place >= 1: it is 0"]);
    }

    #[test]
    fn texts_are_joined_where_they_differ() {
        let check = |texts: &[&str], expected: &str| assert_eq!(with_options(texts), expected);
        check(&["on_left_pad >= 1", "on_right_pad >= 1"], "on_[left / right]_pad >= 1");
        check(&["f(1)", "f(1, 2)"], "f(1[ / , 2])");
        check(&["aloft"], "aloft");
        check(&["lifted", "held"], "[lifted / held]");
    }
}
