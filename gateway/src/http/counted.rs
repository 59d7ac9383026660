//! Calls of tools, counted and timed, whichever face they come by.

use std::time::Instant;

use tandem_tools_spec::{EPISODE_TOOLS, ListTasks, Say, StartEpisode, Tool as _};

use super::{app::App, problem::ApiError};

/// Answers a call of the tool `name` by `work`, and counts it with its status and the time it took.
pub async fn counted<T>(
    app: &App,
    name: &str,
    work: impl Future<Output = Result<T, ApiError>>,
) -> Result<T, ApiError> {
    let began = Instant::now();
    let answer = work.await;
    let status = answer.as_ref().map_or_else(|refusal| refusal.status().as_u16(), |_| 200);
    app.table.metrics().call_answered(known(name).unwrap_or("unknown"), status, began.elapsed());
    answer
}

/// The tool called `name`. Only names of ours are counted: callers could make up any number of others.
fn known(name: &str) -> Option<&'static str> {
    every_tool().into_iter().find(|tool| *tool == name)
}

/// The names of all tools, with those that need no episode and the one that only some episodes have.
pub fn every_tool() -> Vec<&'static str> {
    [ListTasks::NAME, StartEpisode::NAME]
        .into_iter()
        .chain(EPISODE_TOOLS.iter().copied())
        .chain([Say::NAME])
        .collect()
}
