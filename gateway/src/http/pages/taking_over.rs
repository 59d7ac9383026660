//! "Take over here": people continue a finished episode from one of its moments, as a separate episode.

use axum::{
    Extension,
    body::Bytes,
    extract::State,
    http::header,
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use tandem_episodes::{CONTROL_HZ, EpisodeSpec, MomentStart, Start};
use tandem_tools_spec::{Driving, Operators, Protocol};

use super::finished::folder_of;
use crate::http::{
    app::AppState,
    problem::ApiError,
    watching::{Host, RECORDING},
};

/// Maximum time that the other robots wait for an absent person.
const PATIENCE_S: f64 = 600.0;

/// Moment from which to continue.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TakeOver {
    run: String,
    time_s: f64,
    protocol: Protocol,
}

/// Starts an episode from a moment of a finished one, with an operator for each robot.
///
/// The episode starts after the last call that was answered by that moment. The reply is the same as for any
/// other start. The request needs both the watch link and the right to start episodes.
pub async fn take_over(
    State(app): State<AppState>,
    host: Option<Extension<Host>>,
    body: Bytes,
) -> Result<Response, ApiError> {
    let Extension(Host) = host.ok_or(ApiError::NoToken)?;
    let wanted: TakeOver =
        serde_json::from_slice(&body).map_err(|error| ApiError::MalformedJson(error.to_string()))?;
    let folder = folder_of(&app, wanted.run)?;
    let at = folder.clone();
    let recorded = app.recordings.read(move |last| Ok(last.open(&at)?.episode.spec().clone())).await?;
    let settings = &app.settings;
    // The reading thread may have another working directory.
    let recording = std::path::absolute(folder.join(RECORDING)).unwrap_or_else(|_| folder.join(RECORDING));
    let control_step = (wanted.time_s.max(0.0) * CONTROL_HZ).round() as u64;
    let spec = EpisodeSpec {
        start: Start::Moment(MomentStart { recording, control_step, before_s: None }),
        protocol: wanted.protocol,
        renderer: settings.renderer,
        assistance: settings.assistance,
        disclosure: settings.disclosure,
        hints: settings.hints,
        instructions: settings.instructions.own_words(&recorded.task.id),
        thinking_limit_s: settings.thinking_limit_s,
        ..recorded
    };
    let driving =
        Driving { operators: Some(Operators::PerRobot), patience_s: Some(PATIENCE_S), talk: Some(true) };
    let reply = app.table.start_spec(spec, &driving).await?;
    Ok(([(header::CACHE_CONTROL, "no-store")], axum::Json(reply)).into_response())
}
