//! What every handler needs: the episodes and the settings, and calls of tools counted and timed, whichever protocol they come by.

use std::{sync::Arc, time::Instant};

use tandem_tools_spec::{EPISODE_TOOLS, ListTasks, StartEpisode, Tool as _};

use super::problem::ApiError;
use crate::{hosting::EpisodeTable, settings::Settings};

/// The server as its handlers see it.
#[derive(Debug, Clone)]
pub struct AppState {
    /// The episodes that are held.
    pub table: Arc<EpisodeTable>,
    /// What the server was told.
    pub settings: Arc<Settings>,
}

/// Answers a call of the tool `name` by `work`, and counts it with its status and the time it took.
pub async fn counted<T>(
    app: &AppState,
    name: &str,
    work: impl Future<Output = Result<T, ApiError>>,
) -> Result<T, ApiError> {
    let began = Instant::now();
    let answer = work.await;
    let status = answer.as_ref().map_or_else(|refusal| refusal.status().as_u16(), |_| 200);
    app.table.metrics().call_answered(known(name).unwrap_or("unknown"), status, began.elapsed());
    answer
}

/// The tool called `name`. Only names of tools are counted: callers could make up any number of others.
fn known(name: &str) -> Option<&'static str> {
    every_tool().into_iter().find(|tool| *tool == name)
}

/// The names of all tools: those that need no episode, those of every episode, and those that only some episodes have.
pub fn every_tool() -> Vec<&'static str> {
    [ListTasks::NAME, StartEpisode::NAME].into_iter().chain(EPISODE_TOOLS.iter().copied()).collect()
}
