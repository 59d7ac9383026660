//! Pages for people: of one episode, and of evaluations.

pub(crate) mod episode;
mod evaluation;

pub use evaluation::{
    ByCollaboration, Comparison, EpisodeCosts, EvaluationReport, ExcludedEpisodes, Failure, FailureMoment,
    FailureReason, Film, FilmContent, FilmPlace, FilmedEpisode, FloorRate, FoundEpisode, LoadError,
    LoadedEpisodes, MeanRate, ModelCosts, PairedRow, PhaseReport, PolicyReport, PublishedAverages,
    PublishedRates, Rate, ReportFormat, ReportPictures, ShownReport, TaskAverage, TaskFloor, TaskReport,
    ValueRange, failure_moments, film_places, gallery, load, pictured_failures,
};
