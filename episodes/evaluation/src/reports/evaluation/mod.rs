//! Reports on played episodes: rates with intervals, averages, effort, causes of failures, and comparisons of
//! policies on the same seeds. A report is a self-contained page or a text.

mod compare;
mod costs;
mod csv;
mod episodes;
mod figure;
mod floor;
mod header;
mod load;
mod page;
mod policy;
mod published;
mod rate;
mod stress;
mod tables;
#[cfg(test)]
pub(super) mod tests;
mod text;
mod went_wrong;

use serde::Serialize;
use tandem_episodes::tasks;

pub use compare::{Comparison, PairedRow};
pub use costs::{AskedCosts, CostSum, EpisodeCosts, ModelCosts, ValueRange};
pub use episodes::EpisodeRow;
pub use floor::{FloorRate, TaskFloor};
pub use header::{ReportHeader, ReportOrigin, RunSettings};
pub(super) use header::{days, ended_between};
pub use load::{FolderProcess, FoundEpisode, LoadError, LoadedEpisodes, load};
pub use page::ReportPictures;
pub use page::films::{Film, FilmContent, FilmPlace, FilmedEpisode, film_places};
pub use page::gallery::{Failure, gallery, pictured_failures};
pub use policy::{
    ByCollaboration, ExcludedEpisodes, FailureReason, PhaseReport, PolicyReport, ShownReport, TaskAverage,
    TaskReport,
};
pub(super) use published::{PUBLISHED_IN, rows as published_rows};
pub use published::{PublishedAverages, PublishedRates};
pub use rate::{MeanRate, Rate};
pub use stress::{AxisLoss, PairedLoss, StressReport, StressRow};
pub(crate) use went_wrong::moment_of_failure;
pub use went_wrong::{FailureMoment, failure_moments};

/// Content of a report, without images.
#[derive(Debug, Serialize)]
pub struct EvaluationReport {
    pub header: ReportHeader,
    /// The policies, in the order in which they were found.
    pub policies: Vec<PolicyReport>,
    /// Comparisons of each policy with the first.
    pub comparisons: Vec<Comparison>,
    /// Results of policies that were also played under stress.
    pub stress: Vec<StressReport>,
    /// Floors of the played tasks, which policies without perception reach.
    pub floors: Vec<TaskFloor>,
    /// Published rates of the same tasks in another simulator.
    pub published: Vec<PublishedRates>,
    pub published_averages: Vec<PublishedAverages>,
    /// Moments at which recorded failures went wrong, up to a limit on their number.
    pub failure_moments: Vec<FailureMoment>,
    /// Number of recorded failures, listed or not.
    pub recorded_failures: usize,
    /// One row for each episode.
    pub episodes: Vec<EpisodeRow>,
    /// Files that contain no episode, with the reasons.
    pub skipped: Vec<String>,
}

/// Format of a report that is text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReportFormat {
    Html,
    Markdown,
    Csv,
    Json,
    Tex,
    /// One line for each episode.
    EpisodesCsv,
    /// Figure of the rates of phases.
    Svg,
    /// Figure of the times at which phases were reached.
    TimesSvg,
}

impl ReportFormat {
    pub const ALL: [ReportFormat; 8] = [
        ReportFormat::Html,
        ReportFormat::Markdown,
        ReportFormat::Csv,
        ReportFormat::Json,
        ReportFormat::Tex,
        ReportFormat::EpisodesCsv,
        ReportFormat::Svg,
        ReportFormat::TimesSvg,
    ];

    /// Returns the file extension of the format.
    pub fn name(self) -> &'static str {
        match self {
            ReportFormat::Html => "html",
            ReportFormat::Markdown => "md",
            ReportFormat::Csv => "csv",
            ReportFormat::Json => "json",
            ReportFormat::Tex => "tex",
            ReportFormat::EpisodesCsv => "episodes.csv",
            ReportFormat::Svg => "svg",
            ReportFormat::TimesSvg => "times.svg",
        }
    }
}

impl EvaluationReport {
    /// Evaluates the loaded episodes.
    pub fn of(loaded: &LoadedEpisodes) -> EvaluationReport {
        let all = || loaded.episodes.iter();
        let plain = all().filter(|found| found.played.spec.stress.is_none());
        // If all episodes are under stress, they are reported like episodes without stress.
        let groups = match plain.clone().next() {
            Some(_) => policy::groups(plain),
            None => policy::groups(all()),
        };
        let policies: Vec<PolicyReport> = groups.iter().map(PolicyReport::of).collect();
        let comparisons = match groups.split_first() {
            Some((first, others)) => others.iter().map(|other| Comparison::of(first, other)).collect(),
            None => Vec::new(),
        };
        let played = |task: &str| policies.iter().any(|policy| policy.tasks.iter().any(|of| of.task == task));
        EvaluationReport {
            header: ReportHeader {
                made: None,
                settings: groups.iter().filter_map(RunSettings::of).collect(),
                processes: loaded.processes.clone(),
            },
            episodes: episodes::rows(loaded),
            recorded_failures: went_wrong::recorded_failures(&groups),
            published: published::rows().into_iter().filter(|row| played(&row.task)).collect(),
            published_averages: published::averages(),
            floors: floor::floors(&groups, &policies),
            stress: stress::stress_reports(all()),
            failure_moments: Vec::new(),
            skipped: loaded.skipped.clone(),
            policies,
            comparisons,
        }
    }

    /// Writes the report. Only pages contain `pictures`.
    pub fn write(
        &self,
        format: ReportFormat,
        pictures: &ReportPictures,
    ) -> Result<String, serde_json::Error> {
        Ok(match format {
            ReportFormat::Html => page::html(self, pictures),
            ReportFormat::Markdown => text::markdown(self),
            ReportFormat::Csv => csv::rates(self),
            ReportFormat::Json => serde_json::to_string_pretty(self)? + "\n",
            ReportFormat::Tex => text::tex(self),
            ReportFormat::EpisodesCsv => episodes::csv(&self.episodes),
            ReportFormat::Svg => figure::rates_file(&self.tasks(), &self.policies),
            ReportFormat::TimesSvg => figure::times_file(&self.tasks(), &self.policies),
        })
    }

    /// Returns a row for each episode as a Parquet file.
    pub fn episodes_parquet(&self) -> Vec<u8> {
        episodes::parquet(&self.episodes)
    }

    /// Returns the tasks that any policy has played, in the order of the task list, followed by tasks from
    /// files.
    fn tasks(&self) -> Vec<&str> {
        let played = || self.policies.iter().flat_map(|policy| &policy.tasks).map(|task| task.task.as_str());
        let known = tasks::cohub().iter().map(|task| task.id.as_str());
        let mut found: Vec<&str> = known.filter(|id| played().any(|one| one == *id)).collect();
        for id in played() {
            if !found.contains(&id) {
                found.push(id);
            }
        }
        found
    }
}
