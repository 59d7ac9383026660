//! State that every handler needs: the episodes and the settings. Tool calls are counted and timed here,
//! for all protocols.

use std::{sync::Arc, time::Instant};

use serde_json::Value;
use tandem_tools_spec::{
    EPISODE_TOOLS, ListTasks, StartEpisode, Tool as _, ToolSpec, Wording, operator_tool_specs, tool_specs,
};

use tokio::sync::Semaphore;

use super::{
    problem::ApiError,
    watching::{KnownEvaluations, KnownTextures, MAX_WATCHERS, RecordingReader, TaskPictures, WatchKey},
};
use crate::{
    hosting::{Caller, EpisodeTable},
    settings::Settings,
};

/// The version of this program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// State of the server for its handlers.
#[derive(Debug, Clone)]
pub struct AppState {
    /// Episodes that the server holds.
    pub table: Arc<EpisodeTable>,
    /// Settings of the server.
    pub settings: Arc<Settings>,
    /// Key that watchers need.
    pub watch_key: WatchKey,
    /// Limit on the number of watchers.
    pub watchers: Arc<Semaphore>,
    /// Reader of recordings for watchers.
    pub recordings: RecordingReader,
    /// Reader of recordings for films, which take longer.
    pub films: RecordingReader,
    /// Evaluations in the runs folder, as of their last listing.
    pub evaluations: KnownEvaluations,
    /// Pictures of the tasks for the start page.
    pub task_pictures: TaskPictures,
    /// Images on surfaces of the scenes that pages draw.
    pub textures: KnownTextures,
}

impl AppState {
    /// Creates the state of a server that holds no episode yet.
    pub fn new(table: Arc<EpisodeTable>, settings: Arc<Settings>, watch_key: WatchKey) -> AppState {
        let watchers = Arc::new(Semaphore::new(MAX_WATCHERS));
        let (recordings, films) = (RecordingReader::start(), RecordingReader::start());
        AppState {
            table,
            settings,
            watch_key,
            watchers,
            recordings,
            films,
            evaluations: KnownEvaluations::default(),
            task_pictures: TaskPictures::default(),
            textures: KnownTextures::default(),
        }
    }

    /// Returns the texts about tools for `caller`.
    pub fn wording(&self, caller: &Caller) -> Wording {
        let wording = self.settings.wording();
        match caller {
            Caller::Host => wording,
            Caller::Operator { .. } => wording.for_operator(),
        }
    }

    /// Returns the tools that `caller` may use. The tools for talking are only for operators that may talk.
    pub fn tool_specs(&self, caller: &Caller) -> Vec<ToolSpec> {
        let mut specs = match self.table.may_talk(caller) {
            true => operator_tool_specs(self.wording(caller)),
            false => tool_specs(self.wording(caller)),
        };
        if let Caller::Operator { .. } = caller {
            // An operator's episode is already running, and an operator cannot start another.
            specs.retain(|spec| spec.on_episode);
        }
        specs
    }

    /// Returns the description of the REST interface for `caller`.
    pub fn openapi(&self, caller: &Caller) -> Value {
        tandem_tools_spec::openapi(VERSION, self.wording(caller), self.table.may_talk(caller))
    }
}

/// Runs `work` to answer a call of the tool `name`, and records its status and duration.
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

/// Returns the tool called `name`. Only known names are counted, because callers could invent any number of
/// names.
fn known(name: &str) -> Option<&'static str> {
    every_tool().into_iter().find(|tool| *tool == name)
}

/// Returns the names of all tools: those that need no episode, those of every episode, and those of only some
/// episodes.
pub fn every_tool() -> Vec<&'static str> {
    [ListTasks::NAME, StartEpisode::NAME].into_iter().chain(EPISODE_TOOLS.iter().copied()).collect()
}
