//! Failure moments of recorded episodes: the first moment worth looking at, and the address of the page that
//! shows it.

use std::path::Path;

use serde::Serialize;
use tandem_episodes::{Facts, Grip, Recording, RecordingError};

use super::load::{FoundEpisode, LoadedEpisodes};
use super::policy::{PolicyGroup, failed, failed_by_turns, first_missed_phase};
use crate::reports::links::{encoded, relative};

/// Default address of `tandem serve`.
const SERVED_AT: &str = "http://127.0.0.1:8700";
/// Downward speed from which an object that no hand holds counts as dropped; objects are set down more
/// slowly.
const DROPPED_M_S: f32 = 0.8;

/// The moment at which an episode began to fail.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailureMoment {
    pub policy: String,
    pub task: String,
    pub seed: u32,
    /// Number of the first counted phase that was not reached.
    pub phase: String,
    /// Description, for example "A fell".
    pub what: String,
    /// Simulated time of the moment.
    pub time_s: f64,
    /// Address of the page that shows the moment, on a server whose runs folder contains the recording.
    pub watch: String,
    /// Link from the report to the episode's own page; `None` if there is none.
    pub page: Option<String>,
}

/// Returns the moments of at most `most` recorded failures, taken in turn from each policy and task. Links
/// are relative to a report in `folder`.
pub fn failure_moments(loaded: &LoadedEpisodes, most: usize, folder: &Path) -> Vec<FailureMoment> {
    let failures = failed_by_turns(loaded, most, |found| found.recording.is_some());
    failures.into_iter().filter_map(|(policy, found)| moment(&policy, found, folder)).collect()
}

/// Returns the number of failures that were recorded.
pub fn recorded_failures(groups: &[PolicyGroup]) -> usize {
    groups.iter().flat_map(failed).filter(|found| found.recording.is_some()).count()
}

/// Returns the moment of a failure; `None` if the recording cannot be read.
fn moment(policy: &str, found: &FoundEpisode, folder: &Path) -> Option<FailureMoment> {
    let recording = Recording::read(found.recording.as_deref()?).ok()?;
    let (time_s, what) = moment_of_failure(&recording).ok()?;
    let spec = &found.played.spec;
    Some(FailureMoment {
        policy: policy.into(),
        task: spec.task.id.clone(),
        seed: spec.seed,
        phase: first_missed_phase(&found.played),
        what,
        time_s,
        watch: watch_address(&found.run, time_s),
        page: found.page.as_ref().and_then(|page| relative(folder, page)),
    })
}

/// Returns the first failure: a fall of a robot, or a drop of an object after the last reached phase. Returns
/// the end of the recording if there is neither.
pub(crate) fn moment_of_failure(recording: &Recording) -> Result<(f64, String), RecordingError> {
    let mut watcher = Watcher::default();
    let names: Vec<&str> = recording.spec.task.robots.iter().map(|robot| robot.name).collect();
    recording.score_with(|scored| watcher.look(&scored.facts, scored.reached, &names))?;
    Ok(watcher.found.unwrap_or((watcher.last_s, "the end".into())))
}

#[derive(Default)]
struct Watcher {
    last_s: f64,
    /// Time at which each object was last held, in seconds.
    held_s: Vec<Option<f64>>,
    fallen: Vec<bool>,
    /// The first fall, or the first drop since the last reached phase.
    found: Option<(f64, String)>,
}

impl Watcher {
    fn look(&mut self, facts: &Facts, reached: bool, names: &[&str]) {
        self.last_s = facts.time_s;
        if reached {
            // A phase that is reached after a drop cancels the drop, but not a fall.
            self.found = self.found.take().filter(|(_, what)| what.ends_with("fell"));
        }
        self.held_s.resize(facts.objects.len(), None);
        self.fallen.resize(facts.robots.len(), false);
        for (index, robot) in facts.robots.iter().enumerate() {
            if robot.fallen && !self.fallen[index] {
                self.fallen[index] = true;
                self.found.get_or_insert_with(|| (facts.time_s, format!("{} fell", names[index])));
            }
        }
        for (object, held_s) in facts.objects.iter().zip(&mut self.held_s) {
            let mut grips = object.hands.iter().flat_map(|hands| hands.iter());
            if grips.any(|grip| *grip == Grip::Holding) {
                *held_s = Some(facts.time_s);
            } else if object.velocity_m_s.z < -DROPPED_M_S
                && let Some(held_s) = held_s.take()
            {
                let what = format!("{} was dropped", object.name.replace('_', " "));
                self.found.get_or_insert((held_s, what));
            }
        }
    }
}

/// Returns the address of a run's page at a time slightly before the moment.
fn watch_address(run: &str, time_s: f64) -> String {
    format!("{SERVED_AT}/watch?run={}&at={:.1}", encoded(run), (time_s - 1.0).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tandem_episodes::{A, B, Built, EpisodeSpec, ObjectFacts, build_world, tasks};
    use tandem_sim::Sides;
    use tandem_tools_spec::Protocol;

    /// Time in seconds, `true` if a phase was reached, and the change of the facts.
    type WatchedMoment = (f64, bool, fn(Facts) -> Facts);

    /// Returns the facts of Handover at its start.
    fn at_rest() -> Facts {
        let task = tasks::find("handover").unwrap();
        let spec = EpisodeSpec::new(&task, 2000, Protocol::Benchmark);
        let Built { world, motions, .. } = build_world(&spec).unwrap();
        let start = world.present();
        task.scores(&motions[0].robot.model, &start).unwrap().facts(&start)
    }

    /// Returns the failure found in these moments.
    fn found(moments: &[WatchedMoment]) -> Option<(f64, String)> {
        let rest = at_rest();
        let mut watcher = Watcher::default();
        for (time_s, reached, so) in moments {
            watcher.look(&Facts { time_s: *time_s, ..so(rest.clone()) }, *reached, &["A", "B"]);
        }
        watcher.found
    }

    fn bottle(facts: &mut Facts) -> &mut ObjectFacts {
        facts.objects.iter_mut().find(|object| object.name == "bottle").unwrap()
    }

    fn held(mut facts: Facts) -> Facts {
        bottle(&mut facts).hands[A] = Sides::both(Grip::Holding);
        facts
    }

    fn falls(mut facts: Facts) -> Facts {
        bottle(&mut facts).velocity_m_s.z = -1.0;
        facts
    }

    fn fallen(mut facts: Facts) -> Facts {
        facts.robots[B].fallen = true;
        facts
    }

    #[test]
    fn the_first_fall_or_drop_after_the_last_phase_is_what_went_wrong() {
        let rest = |facts: Facts| facts;
        let some = |time_s: f64, what: &str| Some((time_s, what.to_owned()));
        assert_eq!(
            found(&[(0.0, false, rest), (1.0, false, held), (2.0, true, held), (3.0, false, rest)]),
            None
        );
        let dropped = [
            (1.0, false, held as fn(Facts) -> Facts),
            (1.2, false, rest),
            (1.3, false, falls),
            (4.0, false, fallen),
        ];
        assert_eq!(found(&dropped), some(1.0, "bottle was dropped"));
        let made_good = [&dropped[..3], &[(5.0, false, held), (6.0, true, held)]].concat();
        assert_eq!(found(&made_good), None);
        assert_eq!(
            found(&[&made_good[..], &[(7.0, false, fallen), (8.0, true, fallen)]].concat()),
            some(7.0, "B fell")
        );
        // An object that was never held falls for other reasons.
        assert_eq!(found(&[(1.0, false, falls)]), None);
    }

    #[test]
    fn addresses_hold_any_folder() {
        assert_eq!(
            watch_address("expert/episodes/handover-seed3", 12.34),
            "http://127.0.0.1:8700/watch?run=expert/episodes/handover-seed3&at=11.3"
        );
        assert_eq!(watch_address("a b&c/ü", 0.4), "http://127.0.0.1:8700/watch?run=a%20b%26c/%C3%BC&at=0.0");
    }
}
