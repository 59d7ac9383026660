//! Pages for people: of one episode, and of evaluations.

pub(crate) mod episode;
mod evaluation;

pub use evaluation::{
    ByCollaboration, Comparison, EpisodeCosts, EvaluationReport, ExcludedEpisodes, Failure, FailureReason,
    Film, FilmContent, FilmPlace, FilmedEpisode, FoundEpisode, LoadError, LoadedEpisodes, MeanRate,
    PairedRow, PhaseReport, PolicyReport, PublishedAverages, PublishedRates, Rate, ReportFormat,
    ReportPictures, ShownReport, TaskAverage, TaskReport, ValueRange, film_places, gallery, load,
    pictured_failures,
};
