//! What episodes that were played come to: rates with what they leave open, averages, effort, why episodes failed, and how two
//! policies compare on the same seeds; as one page that needs nothing else, or as text.

mod compare;
mod gallery;
mod load;
mod page;
mod policy;
mod published;
mod rate;
mod tables;
#[cfg(test)]
mod tests;
mod text;

use serde::Serialize;

pub use compare::{Comparison, PairedRow};
pub use gallery::{Failure, gallery};
pub use load::{Found, LoadError, Loaded, load};
pub use policy::{Average, Effort, PhaseReport, PolicyReport, Reason, Spread, TaskReport, Together};
pub use published::{Published, PublishedAverages};
pub use rate::{Mean, Rate};

/// Everything that a report says in words and numbers.
#[derive(Debug, Serialize)]
pub struct Assessment {
    /// In the order in which they were found.
    pub policies: Vec<PolicyReport>,
    /// Each policy against the first.
    pub comparisons: Vec<Comparison>,
    /// What was published of the same tasks in another simulator.
    pub published: Vec<Published>,
    pub published_averages: Vec<PublishedAverages>,
    /// Files that are no episodes, and why.
    pub skipped: Vec<String>,
}

/// How a report is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Html,
    Markdown,
    Csv,
    Json,
    Tex,
}

impl Format {
    pub const ALL: [Format; 5] = [Format::Html, Format::Markdown, Format::Csv, Format::Json, Format::Tex];

    /// What the file's extension is.
    pub fn name(self) -> &'static str {
        match self {
            Format::Html => "html",
            Format::Markdown => "md",
            Format::Csv => "csv",
            Format::Json => "json",
            Format::Tex => "tex",
        }
    }
}

impl Assessment {
    /// Counts what was found.
    pub fn of(loaded: &Loaded) -> Assessment {
        let groups = policy::groups(&loaded.episodes);
        let policies: Vec<PolicyReport> = groups.iter().map(PolicyReport::of).collect();
        let comparisons = match groups.split_first() {
            Some((first, others)) => others.iter().map(|other| Comparison::of(first, other)).collect(),
            None => Vec::new(),
        };
        let played = |task: &str| policies.iter().any(|policy| policy.tasks.iter().any(|of| of.task == task));
        Assessment {
            published: published::rows().into_iter().filter(|row| played(&row.task)).collect(),
            published_averages: published::averages(),
            skipped: loaded.skipped.clone(),
            policies,
            comparisons,
        }
    }

    /// The report; a page shows `failures`, too.
    pub fn write(&self, format: Format, failures: &[Failure]) -> Result<String, serde_json::Error> {
        Ok(match format {
            Format::Html => page::html(self, failures),
            Format::Markdown => text::markdown(self),
            Format::Csv => text::csv(self),
            Format::Json => serde_json::to_string_pretty(self)? + "\n",
            Format::Tex => text::tex(self),
        })
    }
}
