//! What every handler needs: the episodes and the settings, and calls of tools counted and timed, whichever protocol they come by.

use std::{sync::Arc, time::Instant};

use serde_json::Value;
use tandem_tools_spec::{
    EPISODE_TOOLS, ListTasks, StartEpisode, Tool as _, ToolSpec, operator_tool_specs, tool_specs,
};

use tokio::sync::Semaphore;

use super::{
    problem::ApiError,
    watching::{KnownEvaluations, MAX_WATCHERS, RecordingReader, WatchKey},
};
use crate::{
    hosting::{Caller, EpisodeTable},
    settings::Settings,
};

/// The version of this program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The server as its handlers see it.
#[derive(Debug, Clone)]
pub struct AppState {
    /// The episodes that are held.
    pub table: Arc<EpisodeTable>,
    /// What the server was told.
    pub settings: Arc<Settings>,
    /// Who may watch.
    pub watch_key: WatchKey,
    /// Places for those who watch.
    pub watchers: Arc<Semaphore>,
    /// Reads the recordings that are watched.
    pub recordings: RecordingReader,
    /// Reads those of which films are made, which takes longer.
    pub films: RecordingReader,
    /// The evaluations in the runs folder, as they were when they were listed last.
    pub evaluations: KnownEvaluations,
}

impl AppState {
    /// A server that holds no episode yet.
    pub fn new(table: Arc<EpisodeTable>, settings: Arc<Settings>, watch_key: WatchKey) -> AppState {
        let watchers = Arc::new(Semaphore::new(MAX_WATCHERS));
        let (recordings, films) = (RecordingReader::start(), RecordingReader::start());
        let evaluations = KnownEvaluations::default();
        AppState { table, settings, watch_key, watchers, recordings, films, evaluations }
    }

    /// The tools that `caller` may be offered: talking is for operators who may.
    pub fn tool_specs(&self, caller: &Caller) -> Vec<ToolSpec> {
        let mut specs = match self.table.may_talk(caller) {
            true => operator_tool_specs(self.settings.wording()),
            false => tool_specs(self.settings.wording()),
        };
        if let Caller::Operator { .. } = caller {
            // An operator's episode goes on already, and no other can be begun.
            specs.retain(|spec| spec.name != StartEpisode::NAME);
        }
        specs
    }

    /// The REST interface as `caller` may use it.
    pub fn openapi(&self, caller: &Caller) -> Value {
        tandem_tools_spec::openapi(VERSION, self.settings.wording(), self.table.may_talk(caller))
    }
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
