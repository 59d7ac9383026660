//! Pages for people: of one episode, and of evaluations.

pub(crate) mod episode;
mod evaluation;

pub use evaluation::{
    Assessment, Average, Comparison, Effort, Failure, Format, Found, LoadError, Loaded, Mean, PairedRow,
    PhaseReport, PolicyReport, Published, PublishedAverages, Rate, Reason, Spread, TaskReport, Together,
    gallery, load,
};
