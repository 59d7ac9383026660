//! What every handler needs.

use std::sync::Arc;

use crate::{hosting::EpisodeTable, settings::Settings};

/// The server as its handlers see it.
#[derive(Debug, Clone)]
pub struct App {
    /// The episodes that are held.
    pub table: Arc<EpisodeTable>,
    /// What the server was told.
    pub settings: Arc<Settings>,
}
