//! `/`: the start page. It shows episodes and tasks, starts episodes, and explains how to connect an agent.
//!
//! It consists only of script and style, so it is public. It gets its data over REST, and with the watch
//! link.

use axum::{
    Router,
    extract::{Query, State},
    http::{HeaderMap, header},
    response::{Html, IntoResponse, Response},
    routing::get,
};
use serde::Deserialize;

use super::{POLICY, blocking, script, style};
use crate::{
    hosting::HostingError,
    http::{
        app::{AppState, VERSION},
        problem::ApiError,
    },
};

const SHELL: &str = include_str!("../../../web/home/page.html");

/// Attribute of the page on a server whose clients may start episodes.
const STARTS: &str = " data-starts";

/// Returns the routes of the page, except for `/` itself, which has a version for programs.
pub fn router() -> Router<AppState> {
    Router::new()
        .route("/home/page.css", get(style))
        .route("/home/page.js", get(script))
        .route("/home/picture", get(picture))
}

/// Returns the page.
pub fn page(app: &AppState) -> Response {
    let shell = match app.table.serves_clients() {
        true => SHELL.to_owned(),
        false => SHELL.replace(STARTS, ""),
    };
    let shell = shell.replace("VERSION", VERSION);
    ([(header::CONTENT_SECURITY_POLICY, POLICY)], Html(shell)).into_response()
}

/// Returns true for the public files of the page.
pub fn is_open(path: &str, headers: &HeaderMap) -> bool {
    matches!(path, "/home/page.css" | "/home/page.js") || path == "/" && wants_page(headers)
}

/// Returns true for a client that asks for HTML, such as a browser. Language models do not.
pub fn wants_page(headers: &HeaderMap) -> bool {
    let accepts = headers.get_all(header::ACCEPT).iter().filter_map(|value| value.to_str().ok());
    accepts.into_iter().any(|accept| accept.contains("text/html"))
}

/// Task whose picture is requested.
#[derive(Debug, Deserialize)]
struct Pictured {
    task: String,
}

/// Renders the start of a task. An evaluation has no pictures, because they take time from its policy.
async fn picture(
    State(app): State<AppState>,
    Query(Pictured { task }): Query<Pictured>,
) -> Result<Response, ApiError> {
    if app.table.is_evaluation() {
        return Err(HostingError::OneEpisode.into());
    }
    let task = app.settings.tasks.find(&task).map_err(HostingError::from)?.clone();
    let pictures = app.task_pictures.clone();
    let png = blocking(move || pictures.of(&task)).await?;
    let headers = [(header::CONTENT_TYPE, "image/png"), (header::CACHE_CONTROL, "no-cache")];
    Ok((headers, axum::body::Bytes::from_owner(png)).into_response())
}
