//! Identity of a run, stored in `run.json`: its policy, episodes, rules and build. Each folder contains one
//! run.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use tandem_episodes::{EpisodeSpec, Start, tasks::Task};
use xxhash_rust::xxh3::xxh3_64;

use super::{EvaluationPlan, Starts};
use crate::results::{PlayedEpisode, PolicyCard, SeedList};

/// Maximum number of differences that an error lists.
const MAX_DIFFERENCES: usize = 6;

/// Maximum number of characters of a policy's name in a folder's name.
const MAX_NAME_CHARS: usize = 40;

/// Fields of a spec that differ between the episodes of a run.
const OF_SINGLE_EPISODES: [&str; 4] = ["task", "seed", "start", "instructions"];

/// The content of `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunIdentity {
    #[serde(flatten)]
    pub policy: PolicyCard,
    /// Name of the base controller; files of different content have different names.
    pub controller: String,
    /// The part of the spec that all its episodes share.
    pub rules: Value,
    /// Source of each task, by id: built in, or the hashes of a task file and of an instructions file.
    pub tasks: BTreeMap<String, String>,
    pub seeds: SeedList,
    /// Starts of its episodes; `None` if they begin at the tasks' own beginnings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub starts: Option<Value>,
    /// Builds that have played it, the most recent last.
    pub builds: Vec<String>,
}

impl RunIdentity {
    /// Returns the identity of the run that plays `plan` on `build` with the base controller of this name.
    pub fn of_plan(plan: &EvaluationPlan, controller: &str, build: &str) -> RunIdentity {
        let seed = plan.seeds.first().copied().unwrap_or_default();
        let planned = |task: &Task| plan.spec(task, seed, Start::Task);
        let specs: Vec<EpisodeSpec> = match &plan.starts {
            Starts::Task | Starts::Phases { .. } => plan.tasks.iter().map(planned).collect(),
            Starts::Moments { failed, .. } => failed.iter().map(|failed| failed.spec.clone()).collect(),
        };
        let seeds = match &plan.starts {
            Starts::Task | Starts::Phases { .. } => plan.seeds.iter().copied().collect(),
            Starts::Moments { failed, .. } => failed.iter().map(|failed| failed.spec.seed).collect(),
        };
        let starts = match &plan.starts {
            Starts::Task => None,
            Starts::Phases { demonstrations, phases, training } => {
                let demonstrations = std::path::absolute(demonstrations).unwrap_or(demonstrations.clone());
                let mut starts = json!({ "phases": phases, "demonstrations": demonstrations });
                if *training {
                    starts["training"] = true.into();
                }
                Some(starts)
            }
            Starts::Moments { failed, before_s } => {
                let failed: Vec<_> = failed.iter().map(|failed| &failed.recording).collect();
                Some(json!({ "again": failed, "before_s": before_s }))
            }
        };
        RunIdentity {
            policy: plan.player.card(),
            controller: controller.into(),
            rules: specs.first().map(rules).unwrap_or_default(),
            tasks: specs.iter().map(|spec| (spec.task.id.clone(), words(spec))).collect(),
            seeds: SeedList(seeds),
            starts,
            builds: vec![build.into()],
        }
        .read_back()
    }

    /// Returns the identity of a run from one of its episodes. Earlier builds wrote no `run.json`.
    pub fn of_episode(played: &PlayedEpisode) -> RunIdentity {
        let spec = &played.spec;
        RunIdentity {
            policy: played.policy.clone(),
            controller: played.locomotion.clone(),
            rules: rules(spec),
            tasks: BTreeMap::from([(spec.task.id.clone(), words(spec))]),
            seeds: SeedList(BTreeSet::from([spec.seed])),
            starts: None,
            builds: vec![played.build.clone()],
        }
        .read_back()
    }

    /// Serializes the identity to text and parses it. Numbers may lose a bit in text, so both sides of a
    /// comparison must be parsed values.
    fn read_back(self) -> RunIdentity {
        let read = serde_json::to_string(&self).and_then(|text| serde_json::from_str(&text));
        read.unwrap_or(self)
    }

    /// Returns the most recent build that has played it.
    pub fn build(&self) -> &str {
        self.builds.last().map_or("", String::as_str)
    }

    /// Returns the differences between this run and the run `now`, a line each. The build, and additional
    /// tasks and seeds, are no differences.
    pub fn differences(&self, now: &RunIdentity) -> Vec<String> {
        let (was, is) = (self.leaves(), now.leaves());
        let names: BTreeSet<&String> = was.keys().chain(is.keys()).collect();
        let missing = "nothing".to_owned();
        let differing = names.into_iter().filter(|name| was.get(*name) != is.get(*name)).map(|name| {
            let of = |leaves: &BTreeMap<String, String>| leaves.get(name).unwrap_or(&missing).clone();
            difference(name, &of(&is), &of(&was))
        });
        let mut found: Vec<String> = differing.collect();
        if self.tasks.iter().any(|(id, words)| now.tasks.get(id) != Some(words)) {
            found.push(format!("tasks are {}, and were {}", now.task_names(), self.task_names()));
        }
        if !self.seeds.0.is_subset(&now.seeds.0) {
            let [is, was] = [now, self].map(|run| String::from(run.seeds.clone()));
            found.push(format!("seeds are {is}, and were {was}"));
        }
        if found.len() > MAX_DIFFERENCES {
            let more = found.len() - MAX_DIFFERENCES;
            found.truncate(MAX_DIFFERENCES);
            found.push(format!("and {more} more"));
        }
        found
    }

    /// Returns `true` if the run `now` has tasks or seeds in addition to those of this run.
    pub fn grows_to(&self, now: &RunIdentity) -> bool {
        self.tasks.len() < now.tasks.len() || self.seeds.0.len() < now.seeds.0.len()
    }

    fn task_names(&self) -> String {
        let name = |(id, words): (&String, &String)| match words.as_str() {
            BUILT_IN => id.clone(),
            words => format!("{id} ({words})"),
        };
        self.tasks.iter().map(name).collect::<Vec<_>>().join(", ")
    }

    /// Returns every value by its path, except for tasks, seeds and builds.
    fn leaves(&self) -> BTreeMap<String, String> {
        let RunIdentity { policy, controller, rules, tasks: _, seeds: _, starts, builds: _ } = self;
        let mut found = BTreeMap::new();
        collect("", &json!(policy), &mut found);
        collect("controller", &json!(controller), &mut found);
        collect("", rules, &mut found);
        collect("starts", &json!(starts), &mut found);
        found
    }

    /// Returns the name of a folder for this run, independent of the build: `expert-benchmark-0123abcd`.
    pub fn folder_name(&self) -> String {
        let all = format!("{:?}", (self.leaves(), &self.tasks, &self.seeds));
        let protocol = self.rules["protocol"].as_str().unwrap_or("run");
        format!("{}-{protocol}-{:08x}", plain(&self.policy.name), xxh3_64(all.as_bytes()) >> 32)
    }
}

/// Returns the default folder in `runs` for the run that plays `plan` with the policy called `name`.
pub fn default_folder(plan: &EvaluationPlan, name: Option<&str>, runs: &Path) -> std::path::PathBuf {
    // Two controller files with one name would share a default, and the second would be refused there.
    let controller = json!(plan.locomotion).to_string();
    let mut identity = RunIdentity::of_plan(plan, &controller, "");
    if let Some(name) = name {
        identity.policy = name.into();
    }
    runs.join(identity.folder_name())
}

/// Source of a task that is not replaced by a file.
const BUILT_IN: &str = "built in";

fn words(spec: &EpisodeSpec) -> String {
    let file = spec.task.file_xxh3().map(|xxh3| format!("{} {xxh3}", spec.task.source.name));
    let instructions = spec.instructions.as_ref().map(|words| format!("instructions {}", words.xxh3));
    let own: Vec<String> = file.into_iter().chain(instructions).collect();
    if own.is_empty() { BUILT_IN.into() } else { own.join(", ") }
}

fn rules(spec: &EpisodeSpec) -> Value {
    let mut rules = json!(spec);
    if let Value::Object(fields) = &mut rules {
        fields.retain(|name, _| !OF_SINGLE_EPISODES.contains(&name.as_str()));
        if let Some(Value::Object(keyed)) = fields.get_mut("keyed_seed") {
            // The seed that the key has drawn also belongs to single episodes.
            keyed.retain(|name, _| name != "drawn");
        }
    }
    rules
}

fn difference(name: &str, is: &str, was: &str) -> String {
    format!("{name} is {is}, and was {was}")
}

fn collect(path: &str, value: &Value, found: &mut BTreeMap<String, String>) {
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                collect(&path, value, found);
            }
        }
        Value::Null => {}
        Value::String(text) => drop(found.insert(path.into(), format!("{text:?}"))),
        value => drop(found.insert(path.into(), value.to_string())),
    }
}

/// Converts a policy's name to part of a folder's name.
fn plain(name: &str) -> String {
    let mut plain = String::new();
    for letter in name.chars() {
        match letter {
            letter if letter.is_ascii_alphanumeric() || "._".contains(letter) => plain.push(letter),
            _ if plain.ends_with('-') || plain.is_empty() => {}
            _ => plain.push('-'),
        }
        if plain.len() == MAX_NAME_CHARS {
            break;
        }
    }
    let plain = plain.trim_matches(['-', '.']);
    if plain.is_empty() { "policy".into() } else { plain.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_named_by_a_policy_whatever_that_is_called() {
        for (name, expected) in [
            ("expert", "expert"),
            ("exec:python3 ../agent.py --model 'x'", "exec-python3-..-agent.py-model-x"),
            ("..", "policy"),
            ("代理", "policy"),
            ("openpi:ws://127.0.0.1:8000", "openpi-ws-127.0.0.1-8000"),
        ] {
            assert_eq!(plain(name), expected);
        }
        assert!(plain(&"long ".repeat(50)).len() <= MAX_NAME_CHARS);
    }
}
