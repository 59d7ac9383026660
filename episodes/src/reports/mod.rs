//! Pages for people: of one episode, and of evaluations.

pub(crate) mod episode;
mod evaluation;

pub use evaluation::{
    ByCollaboration, Comparison, EpisodeCosts, EvaluationReport, Failure, FailureReason, FoundEpisode,
    LoadError, LoadedEpisodes, MeanRate, PairedRow, PhaseReport, PolicyReport, PublishedAverages,
    PublishedRates, Rate, ReportFormat, TaskAverage, TaskReport, ValueRange, gallery, load,
};
