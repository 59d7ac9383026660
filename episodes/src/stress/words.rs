//! Wording stress: the same task, more colloquial, then shorter, then roundabout. Rewordings keep all
//! information on the actions, the hands and the robots that carry them out.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use serde::Deserialize;

use super::StressLevel;
use crate::tasks::{Task, TaskWords, tandem_plus};

/// The rewordings of one task, by level.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Rewording {
    joint: [String; 3],
    robots: BTreeMap<String, [String; 3]>,
}

fn rewordings() -> &'static BTreeMap<String, Rewording> {
    static READ: OnceLock<BTreeMap<String, Rewording>> = OnceLock::new();
    READ.get_or_init(|| serde_json::from_str(include_str!("words.json")).expect("the file is tested"))
}

/// Returns the built-in tasks that have rewordings.
pub fn reworded_tasks() -> impl Iterator<Item = &'static str> {
    let plus = tandem_plus().iter().filter(|task| reworded(task, StressLevel::One).is_some());
    rewordings().keys().map(String::as_str).chain(plus.map(|task| task.id.as_str()))
}

/// Returns the reworded instructions of a task, from its file or from the benchmark's rewordings; `None` if
/// there are none.
pub fn reworded(task: &Task, level: StressLevel) -> Option<TaskWords> {
    if !task.is_benchmark() {
        return task.rewordings.as_ref().map(|levels| level.of(levels.each_ref()).clone());
    }
    let Rewording { joint, robots } = rewordings().get(&task.id)?;
    let of = |texts: &[String; 3]| level.of(texts.each_ref()).clone();
    let robot = |name: &str| robots.get(name).map(of);
    let robots = task.robot_names().map(robot).collect::<Option<_>>()?;
    Some(TaskWords { joint: of(joint), shared: None, robots })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::tasks;

    /// Returns the share of the words of `other` that are not in `own`.
    fn new_share(own: &str, other: &str) -> f64 {
        let words = |text: &str| -> BTreeSet<String> {
            let letters = |c: char| !c.is_alphanumeric();
            text.to_lowercase().split(letters).filter(|word| word.len() > 2).map(String::from).collect()
        };
        let (own, other) = (words(own), words(other));
        other.difference(&own).count() as f64 / other.len() as f64
    }

    fn has(text: &str, word: &str) -> bool {
        text.split(|c: char| !c.is_alphabetic()).any(|one| one == word)
    }

    #[test]
    fn every_role_of_every_task_has_words_that_are_ever_less_its_own() {
        for task in tasks::built_in() {
            let own = TaskWords::of(task);
            let levels = StressLevel::ALL.map(|level| reworded(task, level).expect(&task.id));
            let texts = |words: &TaskWords| [vec![words.joint.clone()], words.robots.clone()].concat();
            let strangeness = levels.each_ref().map(|words| {
                let pairs = texts(&own).into_iter().zip(texts(words));
                pairs.map(|(own, other)| new_share(&own, &other)).sum::<f64>()
            });
            assert!(
                strangeness.is_sorted_by(|a, b| a < b) && strangeness[0] > 0.0,
                "{}: {strangeness:?}",
                task.id
            );
            for words in &levels {
                assert_eq!(words.robots.len(), task.robots.len());
                // Partners may face each other, so their left and right differ.
                for (told, robot) in words.robots.iter().zip(&task.robots) {
                    for (side, other) in [("left", "right"), ("right", "left")] {
                        let asked = has(&robot.instruction, side) && !has(&robot.instruction, other);
                        assert!(!asked || has(told, side), "{} {}: {told}", task.id, robot.name);
                    }
                }
            }
        }
    }
}
