//! `/operate`: a page on which a person starts an episode or drives one robot.
//!
//! It consists only of script and style, so it is public. It gets its data over REST with the token of a
//! robot's operator, and over a socket.

use axum::{
    Extension, Json, Router,
    body::Bytes,
    extract::State,
    http::{StatusCode, header},
    response::{Html, IntoResponse, Response},
    routing::{get, post},
};

use serde::Deserialize;
use serde_json::{Value, json};

use super::{
    POLICY, collecting,
    drive::{self, DRIVE, ENTER},
    script, style, texture,
};
use crate::{
    hosting::{Caller, HostingError},
    http::{app::AppState, problem::ApiError},
};

/// Path of the page.
pub const OPERATE: &str = "/operate";

const SHELL: &str = include_str!("../../../web/operators/page.html");

/// Returns the routes of the page.
pub fn router() -> Router<AppState> {
    Router::new()
        .route(OPERATE, get(page))
        .route("/operate/page.css", get(style))
        .route("/operate/page.js", get(script))
        .route("/operate/texture", get(texture))
        .route("/operate/collection", get(collecting::progress))
        .route("/operate/mark", post(collecting::mark))
        .route("/operate/code", post(collecting::code))
        .route("/operate/expert", post(expert))
        .route("/operate/pace", post(pace))
        .route("/operate/policy", get(known_policy).merge(post(policy)))
        .route(ENTER, post(drive::enter))
        .route(DRIVE, get(drive::drive))
}

/// Returns the link for a person who drives `robot` in a collection, or without a robot the link for its
/// host. Browsers do not send the fragment to servers.
pub fn operator_link(base_url: &str, robot: Option<&str>, token: &str) -> String {
    let robot = robot.map_or_else(String::new, |robot| format!("robot={robot}&"));
    format!("{base_url}{OPERATE}#collection=1&{robot}token={token}")
}

/// Returns true for the public files of the page.
pub fn is_open(path: &str) -> bool {
    path.strip_prefix(OPERATE).is_some_and(|rest| matches!(rest, "" | "/page.css" | "/page.js"))
}

/// Robot whose operator is replaced.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StandIn {
    episode: String,
    robot: String,
}

/// Parses which operator is to be replaced. Only the client that starts episodes may replace one.
fn stand_in(app: &AppState, who: &Caller, body: &[u8]) -> Result<StandIn, ApiError> {
    app.table.check_stand_in(who)?;
    serde_json::from_slice(body).map_err(|error| ApiError::MalformedJson(error.to_string()))
}

/// Lets the task's expert drive a robot from now on.
async fn expert(
    State(app): State<AppState>,
    Extension(who): Extension<Caller>,
    body: Bytes,
) -> Result<StatusCode, ApiError> {
    let StandIn { episode, robot } = stand_in(&app, &who, &body)?;
    let hosted = app.table.with_operators(&episode).await?;
    hosted.operator(&robot)?.take_expert().await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Lets partners' commands continue while the calling operator's page sends one control step after another in
/// real time.
async fn pace(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
) -> Result<StatusCode, ApiError> {
    app.table.own_robot(&caller).await?.pace();
    Ok(StatusCode::NO_CONTENT)
}

/// Returns the name of the policy that can drive beside people, for the client that starts episodes.
async fn known_policy(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
) -> Result<Json<Value>, ApiError> {
    match caller {
        Caller::Host => Ok(Json(json!({ "policy": app.table.partner().ok().map(|policy| policy.name()) }))),
        Caller::Operator { .. } => Err(HostingError::HostsBusiness.into()),
    }
}

/// Lets the policy with which this server was started drive a robot from now on.
async fn policy(
    State(app): State<AppState>,
    Extension(who): Extension<Caller>,
    body: Bytes,
) -> Result<StatusCode, ApiError> {
    let StandIn { episode, robot } = stand_in(&app, &who, &body)?;
    let hosted = app.table.with_operators(&episode).await?;
    let policy = app.table.partner()?;
    hosted.operator(&robot)?.take_policy(policy).await?;
    Ok(StatusCode::NO_CONTENT)
}

async fn page() -> Response {
    ([(header::CONTENT_SECURITY_POLICY, POLICY)], Html(SHELL)).into_response()
}
