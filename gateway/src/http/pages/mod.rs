//! Web pages: `/` is the start page, `/watch` shows running and finished episodes. A page gets its data by
//! HTTP requests and over a WebSocket. Its script and style are embedded in this binary from `gateway/web`.

mod collecting;
pub mod drive;
mod finished;
pub mod home;
mod live;
pub mod operate;
pub mod qr;
mod script;
mod socket;
mod taking_over;

use axum::{
    Extension, Router,
    extract::{Query, Request, State},
    http::{HeaderName, HeaderValue, StatusCode, header},
    middleware::{self, Next},
    response::{Html, IntoResponse, Response},
    routing::{get, post},
};
use serde::Deserialize;
use serde_json::json;

use self::script::script;
use super::{app::AppState, problem::ApiError, watching::Watcher};

const SHELL: &str = include_str!("../../../web/page.html");
const STYLE: &str = include_str!("../../../web/style.css");
const DOOR: &str = include_str!("door.html");

/// Content security policy: all content comes from this server, nothing may be sent elsewhere, and no other
/// site may embed the page.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; \
     base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Path of the pages. All pages below it are for watchers.
pub const WATCH: &str = "/watch";

/// Time for which browsers keep an image on a surface: its address changes with its content.
const KEEP_TEXTURE: &str = "private, max-age=31536000, immutable";

/// Requested episode, robot and moment.
#[derive(Debug, Deserialize)]
struct Wanted {
    /// Id of a hosted episode; `run` is the folder of a finished one.
    episode: Option<String>,
    run: Option<String>,
    robot: Option<String>,
    time_s: Option<f64>,
    file: Option<String>,
}

/// Requested image on a surface.
#[derive(Debug, Deserialize)]
struct WantedTexture {
    hash: String,
}

/// Returns the routes of the pages.
pub fn router() -> Router<AppState> {
    let inside = Router::new()
        .route("/watch/page.js", get(script))
        .route("/watch/page.css", get(style))
        .route("/watch/episodes", get(episodes))
        .route("/watch/scene", get(live::scene))
        .route("/watch/live", get(live::live))
        .route("/watch/camera", get(camera))
        .route("/watch/texture", get(texture))
        .route("/watch/run", get(finished::run))
        .route("/watch/film", get(finished::film))
        .route("/watch/file", get(finished::file))
        .route("/watch/take_over", post(taking_over::take_over))
        .layer(middleware::from_fn(only_watchers));
    inside.route(WATCH, get(page).merge(post(enter)))
}

/// Admits only requests of watchers.
async fn only_watchers(request: Request, next: Next) -> Response {
    match request.extensions().get::<Watcher>() {
        Some(Watcher) => next.run(request).await,
        None => ApiError::NoWatcher.into_response(),
    }
}

/// Returns the page, or the page that asks for the watch link.
async fn page(watcher: Option<Extension<Watcher>>) -> Response {
    match watcher {
        Some(_) => ([(header::CONTENT_SECURITY_POLICY, POLICY)], Html(SHELL)).into_response(),
        None => door(StatusCode::OK),
    }
}

/// Returns the page that asks for the watch link, and reads it from its own URL.
pub fn door(status: StatusCode) -> Response {
    let mut bytes = [0u8; 16];
    if getrandom::fill(&mut bytes).is_err() {
        return ApiError::NoWatcher.into_response();
    }
    let nonce: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; img-src data:; base-uri 'none'; frame-ancestors 'none'"
    );
    let headers = [(header::CONTENT_SECURITY_POLICY, policy)];
    (status, headers, Html(DOOR.replace("NONCE", &nonce))).into_response()
}

/// Sets the cookie for a request with the key.
async fn enter(
    State(app): State<AppState>,
    watcher: Option<Extension<Watcher>>,
) -> Result<Response, ApiError> {
    let secure = app.settings.certificate.is_some();
    let cookie = watcher.and_then(|_| app.watch_key.cookie(secure)).ok_or(ApiError::NoWatcher)?;
    Ok((StatusCode::NO_CONTENT, [(header::SET_COOKIE, cookie)]).into_response())
}

async fn style() -> Response {
    asset("text/css; charset=utf-8", STYLE)
}

fn asset(kind: &'static str, content: impl IntoResponse) -> Response {
    let headers: [(HeaderName, HeaderValue); 2] = [
        (header::CONTENT_TYPE, HeaderValue::from_static(kind)),
        // Another build of the program has other files under the same names.
        (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
    ];
    (headers, content).into_response()
}

/// Lists running and finished episodes, and evaluations.
async fn episodes(State(app): State<AppState>) -> Result<Response, ApiError> {
    let held = app.table.watched();
    let runs = app.settings.runs.clone();
    let go_on = held.episodes.iter().filter(|entry| entry.ended.is_none());
    let running: Vec<String> = go_on.map(|entry| entry.episode_id.clone()).collect();
    let found = blocking(move || Ok((finished::list(&runs, &running), app.evaluations.list(&runs)))).await?;
    let (finished, evaluations) = found;
    let told = json!({
        "version": super::app::VERSION,
        "held": held.episodes,
        "asleep": app.table.asleep(),
        "evaluations": evaluations,
        "finished": finished,
    });
    Ok(axum::Json(told).into_response())
}

/// Returns a robot's camera image, current or at a moment of a finished episode.
async fn camera(State(app): State<AppState>, Query(wanted): Query<Wanted>) -> Result<Response, ApiError> {
    let png = match wanted.run.is_some() {
        true => finished::picture(app, wanted).await?,
        false => live::picture(app, wanted).await?,
    };
    let headers = [(header::CONTENT_TYPE, "image/png"), (header::CACHE_CONTROL, "no-store")];
    Ok((headers, png).into_response())
}

/// Returns an image on the surfaces of a scene that a page draws.
async fn texture(
    State(app): State<AppState>,
    Query(WantedTexture { hash }): Query<WantedTexture>,
) -> Result<Response, ApiError> {
    let texture = app.textures.find(&hash).ok_or(ApiError::NoTexture { hash })?;
    let file = blocking(move || texture.file().map_err(|failed| ApiError::Reply(failed.into()))).await?;
    let headers = [(header::CONTENT_TYPE, file.media_type), (header::CACHE_CONTROL, KEEP_TEXTURE)];
    Ok((headers, file.bytes).into_response())
}

/// Runs slow work on a thread for blocking work, off the threads for requests.
async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, ApiError> + Send + 'static,
) -> Result<T, ApiError> {
    tokio::task::spawn_blocking(work).await.map_err(|failed| ApiError::Reply(failed.into()))?
}
