//! Gallery of failures, with small images of their key moments.

use tandem_episodes::{
    html::escape,
    pages::{KeyMoment, moments, strip},
};

use crate::reports::evaluation::load::{FoundEpisode, LoadedEpisodes};
use crate::reports::evaluation::page::ReportPictures;
use crate::reports::evaluation::policy::{
    PolicyReport, failed, failed_by_turns, failure_cause, first_missed_phase, groups,
};

/// One failed episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    pub policy: String,
    pub task: String,
    pub seed: u32,
    /// Number of the first counted phase that was not reached.
    pub phase: String,
    pub why: String,
    /// Key moments; empty if the strip cannot be read.
    pub moments: Vec<KeyMoment>,
}

/// Scale at which the page shows the strip's images, which are 400 pixels wide.
const SCALE: f64 = 0.5;

/// Returns at most `most` failures with images, taken in turn from each policy and task.
pub fn gallery(loaded: &LoadedEpisodes, most: usize) -> Vec<Failure> {
    let pictured = failed_by_turns(loaded, most, |found| found.strip.is_some()).into_iter();
    let pictured = pictured.map(|(policy, found)| {
        let moments = found.strip.as_deref().and_then(|path| strip::read(path, SCALE)).unwrap_or_default();
        Failure { moments, ..failure(&policy, found) }
    });
    pictured.collect()
}

/// Returns the number of failures that have images.
pub fn pictured_failures(loaded: &LoadedEpisodes) -> usize {
    let failures = groups(loaded.episodes.iter());
    failures.iter().flat_map(failed).filter(|found| found.strip.is_some()).count()
}

fn failure(policy: &str, found: &FoundEpisode) -> Failure {
    let spec = &found.played.spec;
    Failure {
        policy: policy.into(),
        task: spec.task.id.clone(),
        seed: spec.seed,
        phase: first_missed_phase(&found.played),
        why: failure_cause(&found.played),
        moments: Vec::new(),
    }
}

/// Renders failures with their key moments as a section of the page.
pub fn html(pictures: &ReportPictures, policies: &[PolicyReport]) -> String {
    let failures = &pictures.failures;
    let failed: usize =
        policies.iter().flat_map(|policy| &policy.reasons).map(|reason| reason.seeds.len()).sum();
    let shown = failures.len();
    let note = match (failed, shown, pictures.pictured_failures) {
        (0, ..) => "No episode failed.".into(),
        (_, 0, 1..) => {
            format!(
                "{failed} episodes failed, none of them shown; <code>report --failures 12</code> shows twelve."
            )
        }
        (_, 0, 0) => format!(
            "{failed} episodes failed, none of them recorded; <code>evaluate --record</code> keeps pictures."
        ),
        _ => format!("{shown} of {failed} episodes that failed, with their key moments."),
    };
    let mut shown = String::new();
    for failure in failures.iter().filter(|failure| !failure.moments.is_empty()) {
        let (task, policy, why) = (escape(&failure.task), escape(&failure.policy), escape(&failure.why));
        shown += &format!(
            r#"<p><b>{task}, seed {}</b> {policy}, stuck before {}: {why}</p>{}"#,
            failure.seed,
            failure.phase,
            moments::html(&failure.moments, "moments small"),
        );
    }
    format!(r#"<h2>Failures</h2><p class="soft">{note}</p>{shown}"#)
}
