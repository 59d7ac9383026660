//! Pages for people: of one episode, and of evaluations.

pub(crate) mod episode;
mod evaluation;

pub(crate) use evaluation::moment_of_failure;
pub use evaluation::{
    AskedCosts, AxisLoss, ByCollaboration, Comparison, CostSum, EpisodeCosts, EvaluationReport,
    ExcludedEpisodes, Failure, FailureMoment, FailureReason, Film, FilmContent, FilmPlace, FilmedEpisode,
    FloorRate, FoundEpisode, LoadError, LoadedEpisodes, MeanRate, ModelCosts, PairedLoss, PairedRow,
    PhaseReport, PolicyReport, PublishedAverages, PublishedRates, Rate, ReportFormat, ReportPictures,
    ShownReport, StressReport, StressRow, TaskAverage, TaskFloor, TaskReport, ValueRange, failure_moments,
    film_places, gallery, load, pictured_failures,
};
