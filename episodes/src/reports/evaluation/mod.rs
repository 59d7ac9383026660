//! Reports on played episodes: rates with intervals, averages, effort, causes of failures, and comparisons
//! of policies on the same seeds. A report is a self-contained page, or text.

mod compare;
mod costs;
mod floor;
mod load;
mod page;
mod policy;
mod published;
mod rate;
mod stress;
mod table;
mod tables;
#[cfg(test)]
mod tests;
mod text;
mod went_wrong;

use serde::Serialize;

pub use compare::{Comparison, PairedRow};
pub use costs::{AskedCosts, CostSum, EpisodeCosts, ModelCosts, ValueRange};
pub use floor::{FloorRate, TaskFloor};
pub use load::{FoundEpisode, LoadError, LoadedEpisodes, load};
pub use page::ReportPictures;
pub use page::films::{Film, FilmContent, FilmPlace, FilmedEpisode, film_places};
pub use page::gallery::{Failure, gallery, pictured_failures};
pub use policy::{
    ByCollaboration, ExcludedEpisodes, FailureReason, PhaseReport, PolicyReport, ShownReport, TaskAverage,
    TaskReport,
};
pub use published::{PublishedAverages, PublishedRates};
pub use rate::{MeanRate, Rate};
pub use stress::{AxisLoss, PairedLoss, StressReport, StressRow};
pub(crate) use went_wrong::moment_of_failure;
pub use went_wrong::{FailureMoment, failure_moments};

/// Content of a report, without images.
#[derive(Debug, Serialize)]
pub struct EvaluationReport {
    /// The policies in the order in which they were found.
    pub policies: Vec<PolicyReport>,
    /// Each policy against the first.
    pub comparisons: Vec<Comparison>,
    /// Results of policies that were also played under stress.
    pub stress: Vec<StressReport>,
    /// Floors of these tasks without perception.
    pub floors: Vec<TaskFloor>,
    /// Published rates of the same tasks in another simulator.
    pub published: Vec<PublishedRates>,
    pub published_averages: Vec<PublishedAverages>,
    /// Moments at which recorded failures went wrong, up to a limit on their number.
    pub failure_moments: Vec<FailureMoment>,
    /// Files that are no episodes, with the reasons.
    pub skipped: Vec<String>,
}

/// Format of a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReportFormat {
    Html,
    Markdown,
    Csv,
    Json,
    Tex,
}

impl ReportFormat {
    pub const ALL: [ReportFormat; 5] = [
        ReportFormat::Html,
        ReportFormat::Markdown,
        ReportFormat::Csv,
        ReportFormat::Json,
        ReportFormat::Tex,
    ];

    /// Returns the file extension of the format.
    pub fn name(self) -> &'static str {
        match self {
            ReportFormat::Html => "html",
            ReportFormat::Markdown => "md",
            ReportFormat::Csv => "csv",
            ReportFormat::Json => "json",
            ReportFormat::Tex => "tex",
        }
    }
}

impl EvaluationReport {
    /// Evaluates the loaded episodes.
    pub fn of(loaded: &LoadedEpisodes) -> EvaluationReport {
        let all = || loaded.episodes.iter();
        let plain = all().filter(|found| found.played.spec.stress.is_none());
        // If all episodes are under stress, they are reported like plain ones.
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

    /// Writes the report; `pictures` are for pages only.
    pub fn write(
        &self,
        format: ReportFormat,
        pictures: &ReportPictures,
    ) -> Result<String, serde_json::Error> {
        Ok(match format {
            ReportFormat::Html => page::html(self, pictures),
            ReportFormat::Markdown => text::markdown(self),
            ReportFormat::Csv => text::csv(self),
            ReportFormat::Json => serde_json::to_string_pretty(self)? + "\n",
            ReportFormat::Tex => text::tex(self),
        })
    }
}
