//! Reports for people: on evaluations, and on many runs.

mod evaluation;
mod leaderboard;
mod links;
mod table;

pub(crate) use evaluation::moment_of_failure;
pub use evaluation::{
    AskedCosts, AxisLoss, ByCollaboration, Comparison, CostSum, EpisodeCosts, EpisodeRow, EvaluationReport,
    ExcludedEpisodes, Failure, FailureMoment, FailureReason, Film, FilmContent, FilmPlace, FilmedEpisode,
    FloorRate, FolderProcess, FoundEpisode, LoadError, LoadedEpisodes, MeanRate, ModelCosts, PairedLoss,
    PairedRow, PhaseReport, PolicyReport, PublishedAverages, PublishedRates, Rate, ReportFormat,
    ReportHeader, ReportOrigin, ReportPictures, RunSettings, ShownReport, StressReport, StressRow,
    TaskAverage, TaskFloor, TaskReport, ValueRange, failure_moments, film_places, gallery, load,
    pictured_failures,
};
pub use leaderboard::{BoardCosts, BoardRow, Leaderboard, TranscriptLink};
