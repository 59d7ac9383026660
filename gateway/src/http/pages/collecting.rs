//! Requests of the people in a collection: its progress, and their marks for ended episodes.

use axum::{
    Extension,
    body::Bytes,
    extract::State,
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use serde_json::json;

use super::qr::qr_svg;
use crate::{
    hosting::{Caller, Collection},
    http::{app::AppState, problem::ApiError},
};

/// A person's mark for an episode.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Mark {
    good: bool,
}

/// Text of a QR code.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CodeText {
    text: String,
}

fn collection(app: &AppState) -> Result<&Collection, ApiError> {
    app.table.collection().ok_or(ApiError::NoCollection)
}

/// Returns the progress of the collection. The host also gets the tokens of the people, for their links.
pub async fn progress(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
) -> Result<Response, ApiError> {
    let collection = collection(&app)?;
    let mut told = json!(collection.progress());
    told["robots"] = collection.operators().map(|operator| operator.robot.as_str()).collect();
    if let Caller::Host = caller {
        told["operators"] = json!(collection.operators().collect::<Vec<_>>());
    }
    Ok(([(header::CACHE_CONTROL, "no-store")], axum::Json(told)).into_response())
}

/// Records a person's mark for the ended episode.
pub async fn mark(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    body: Bytes,
) -> Result<Response, ApiError> {
    let collection = collection(&app)?;
    let robot = caller.robot().ok_or(ApiError::NoCollection)?;
    let Mark { good } = read(&body)?;
    match collection.mark(robot, good) {
        true => Ok(axum::Json(json!(collection.progress())).into_response()),
        false => Err(ApiError::NothingToMark),
    }
}

/// Renders a QR code of a text. The text is sent as a body, because URLs are logged.
pub async fn code(body: Bytes) -> Result<Response, ApiError> {
    let CodeText { text } = read(&body)?;
    let picture = qr_svg(&text).map_err(|error| ApiError::Protocol {
        status: StatusCode::UNPROCESSABLE_ENTITY,
        detail: format!("no QR code holds it: {error}; send a link of at most 2000 characters"),
    })?;
    Ok(([(header::CONTENT_TYPE, "image/svg+xml")], picture).into_response())
}

fn read<'a, T: Deserialize<'a>>(body: &'a [u8]) -> Result<T, ApiError> {
    serde_json::from_slice(body).map_err(|error| ApiError::MalformedJson(error.to_string()))
}
