//! REST routes: the routes under `/v1`, and routes about the server itself.

mod docs;
mod home;
mod idempotency;

use axum::{
    Json, Router,
    body::Bytes,
    extract::{Extension, Path, Query, State},
    http::{HeaderMap, StatusCode, header},
    response::{Html, IntoResponse, Response},
    routing::{MethodRouter, get, post},
};
use serde::Deserialize;
use serde_json::{Value, json};
use tandem_tools_spec::{
    Call, EpisodeToolSpec, Format, Note, ResultReply, StartEpisode, TaskList, Tool as _, episode_tool_specs,
    parse_start,
};

use super::{
    app::{AppState, VERSION, counted},
    encoding::Encoding,
    pages::{self, home::wants_page},
    problem::ApiError,
};
use crate::{
    hosting::{Caller, HostingError, IdempotentReply, RefusedCall},
    metrics::MetricsPage,
};
use idempotency::{IdempotencyKey, mark_replayed};

/// Header of responses that are a page for browsers and a text for programs.
const BY_ACCEPT: (header::HeaderName, &str) = (header::VARY, "accept");

/// Returns every route: path, methods, handlers.
fn routes() -> [(&'static str, &'static [&'static str], MethodRouter<AppState>); 15] {
    [
        ("/", &["GET"], get(home)),
        ("/healthz", &["GET"], get(health)),
        ("/metrics", &["GET"], get(metrics)),
        ("/docs", &["GET"], get(docs)),
        ("/v1/tasks", &["GET"], get(tasks)),
        ("/v1/tools", &["GET"], get(tools)),
        ("/v1/openapi.json", &["GET"], get(openapi)),
        // Common location on other servers.
        ("/openapi.json", &["GET"], get(openapi)),
        ("/v1/episodes", &["GET", "POST"], get(episodes).post(start)),
        ("/v1/episodes/{id}", &["GET", "DELETE"], get(status).delete(remove)),
        ("/v1/episodes/{id}/briefing", &["GET"], get(briefing)),
        ("/v1/episodes/{id}/images/{name}", &["GET"], get(image)),
        ("/v1/episodes/{id}/tools", &["GET"], get(episode_tools)),
        ("/v1/episodes/{id}/tools/{name}", &["POST"], post(call)),
        ("/v1/episodes/{id}/notes", &["POST"], post(note)),
    ]
}

/// Returns the router of all routes.
pub fn router() -> Router<AppState> {
    routes().into_iter().fold(Router::new(), |router, (path, _, handlers)| router.route(path, handlers))
}

/// Lists every route with its methods, for example `GET /healthz`.
pub fn served() -> Vec<String> {
    routes().iter().map(|(path, methods, _)| format!("{} {path}", methods.join("|"))).collect()
}

async fn health(State(app): State<AppState>) -> Json<Value> {
    Json(json!({ "status": "ok", "version": VERSION, "episodes": app.table.len() }))
}

/// Query of `GET /v1/tasks`.
#[derive(Debug, Deserialize)]
struct TasksQuery {
    #[serde(default)]
    short: bool,
}

async fn tasks(State(app): State<AppState>, Query(query): Query<TasksQuery>) -> Json<TaskList> {
    let list = app.table.task_list();
    Json(if query.short { list.shortened() } else { list })
}

/// Query of `GET /v1/tools`.
#[derive(Debug, Deserialize)]
struct ToolsQuery {
    format: Option<String>,
}

async fn tools(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    Query(query): Query<ToolsQuery>,
) -> Result<Json<Value>, ApiError> {
    let specs = app.tool_specs(&caller);
    let Some(name) = query.format else { return Ok(Json(json!(specs))) };
    let format = Format::find(&name).ok_or(ApiError::UnknownFormat { name })?;
    Ok(Json(specs.iter().map(|spec| spec.formatted(format)).collect()))
}

async fn episode_tools(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
) -> Result<Json<Vec<EpisodeToolSpec>>, ApiError> {
    let episode = app.table.awake(&id).await?;
    episode.admit(&caller)?;
    let (wording, talk) = (app.wording(&caller), app.table.may_talk(&caller));
    let thread = &episode.thread;
    let own = caller.robot().map(|robot| vec![robot.to_owned()]);
    let robots = own.as_deref().unwrap_or(thread.robots());
    Ok(Json(episode_tool_specs(wording, &id, robots, thread.steps_per_command(), talk)))
}

async fn openapi(State(app): State<AppState>, Extension(caller): Extension<Caller>) -> Json<Value> {
    Json(app.openapi(&caller))
}

/// Returns the description of the interface, as a page or as text.
async fn docs(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    headers: HeaderMap,
) -> Response {
    let document = app.openapi(&caller);
    let answer = match wants_page(&headers) {
        true => {
            let policy = (header::CONTENT_SECURITY_POLICY, "default-src 'none'; style-src 'unsafe-inline'");
            ([policy], Html(docs::page(&document))).into_response()
        }
        false => docs::brief(&document).into_response(),
    };
    ([BY_ACCEPT], answer).into_response()
}

/// Returns the start page. A client that does not ask for HTML, such as a language model, gets a short
/// text instead.
async fn home(State(app): State<AppState>, headers: HeaderMap) -> Response {
    let answer = match wants_page(&headers) {
        true => pages::home::page(&app),
        false => home::brief(VERSION).into_response(),
    };
    ([BY_ACCEPT], answer).into_response()
}

async fn episodes(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    encoding: Encoding,
) -> Result<Response, ApiError> {
    encoding.write(StatusCode::OK, &app.table.list(&caller))
}

async fn metrics(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
) -> Result<Response, ApiError> {
    require_host(&caller)?;
    let page = app.table.metrics().page(app.table.len(), app.table.running());
    Ok(([(header::CONTENT_TYPE, MetricsPage::CONTENT_TYPE)], page).into_response())
}

async fn start(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    encoding: Encoding,
    IdempotencyKey(key): IdempotencyKey,
    body: Bytes,
) -> Result<Response, ApiError> {
    counted(&app, StartEpisode::NAME, async {
        require_host(&caller)?;
        let (args, driving) = parse_start(encoding.read(&body)?)?;
        let IdempotentReply { reply, replayed } = match key {
            Some(key) => app.table.start_once(args, driving, &key).await?,
            None => IdempotentReply { reply: app.table.start_driven(args, driving).await?, replayed: false },
        };
        let location = format!("/v1/episodes/{}", reply.episode_id);
        let written = encoding.write(StatusCode::CREATED, &reply)?;
        Ok(mark_replayed(([(header::LOCATION, location)], written).into_response(), replayed))
    })
    .await
}

async fn status(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    encoding: Encoding,
    Path(id): Path<String>,
) -> Result<Response, ApiError> {
    encoding.write(StatusCode::OK, &app.table.awake(&id).await?.status(&caller).await?)
}

async fn briefing(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    encoding: Encoding,
    Path(id): Path<String>,
) -> Result<Response, ApiError> {
    encoding.write(StatusCode::OK, &app.table.briefing(&id, &caller).await?.over_http(&id))
}

/// Returns the PNG file of an image to which a reply links.
async fn image(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    Path((id, name)): Path<(String, String)>,
) -> Result<Response, ApiError> {
    let png = app.table.hosted(&id)?.image(&caller, &name)?;
    Ok(([(header::CONTENT_TYPE, "image/png")], png.to_vec()).into_response())
}

async fn call(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    encoding: Encoding,
    IdempotencyKey(key): IdempotencyKey,
    Path((id, name)): Path<(String, String)>,
    body: Bytes,
) -> Result<Response, ApiError> {
    counted(&app, &name, async {
        let episode = app.table.awake(&id).await?;
        episode.admit(&caller)?;
        let read = || {
            episode.check_offered(&caller, &name)?;
            Ok(Call::parse(&name, without_episode_id(encoding.read(&body)?, &id)?)?)
        };
        let answer = match read() {
            Ok(call) => episode.call(&caller, call, key.as_deref()).await.map_err(ApiError::from),
            Err(refusal) => {
                episode.refused(&caller, refused_call(&name, encoding, &body, &refusal)).await;
                Err(refusal)
            }
        };
        let IdempotentReply { reply, replayed } =
            answer.map_err(|refusal: ApiError| refusal.in_episode(&episode.thread))?;
        let status = if reply.others_play_on { StatusCode::ACCEPTED } else { StatusCode::OK };
        Ok(mark_replayed(encoding.write(status, &*reply)?, replayed))
    })
    .await
}

/// Returns a call that could not be parsed, in its original form.
fn refused_call(tool: &str, encoding: Encoding, body: &[u8], refusal: &ApiError) -> RefusedCall {
    let arguments = match encoding.read(body) {
        Ok(arguments) => arguments.to_string(),
        Err(_) => String::from_utf8_lossy(body).into_owned(),
    };
    RefusedCall { tool: tool.into(), arguments, problem: refusal.to_string() }
}

/// Records a note of the player.
async fn note(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    encoding: Encoding,
    IdempotencyKey(key): IdempotencyKey,
    Path(id): Path<String>,
    body: Bytes,
) -> Result<StatusCode, ApiError> {
    let episode = app.table.awake(&id).await?;
    episode.admit(&caller)?;
    let note = Note::parse(encoding.read(&body)?)?;
    let kept = episode.note(&caller, note, key.as_deref()).await;
    kept.map_err(|refusal| ApiError::from(refusal).in_episode(&episode.thread))?;
    Ok(StatusCode::NO_CONTENT)
}

async fn remove(
    State(app): State<AppState>,
    Extension(caller): Extension<Caller>,
    Path(id): Path<String>,
) -> Result<Json<ResultReply>, ApiError> {
    match app.table.awake(&id).await {
        // An episode that cannot be played here can still be removed.
        Err(error) if error.is_of_other_build() => app.table.hosted(&id)?.admit(&caller)?,
        hosted => hosted?.admit(&caller)?,
    }
    require_host(&caller)?;
    Ok(Json(app.table.remove(&id).await?))
}

/// Refuses an operator, because requests that concern more than its robot are reserved for the client that
/// started the episode.
fn require_host(caller: &Caller) -> Result<(), HostingError> {
    match caller {
        Caller::Host => Ok(()),
        Caller::Operator { .. } => Err(HostingError::HostsBusiness),
    }
}

/// Removes `episode_id`, which MCP clients send among the arguments. It must equal the id in the path.
fn without_episode_id(mut args: Value, id: &str) -> Result<Value, ApiError> {
    match args.as_object_mut().and_then(|object| object.shift_remove("episode_id")) {
        Some(body) if body != id => {
            Err(ApiError::EpisodeMismatch { path: id.into(), body: body.to_string() })
        }
        _ => Ok(args),
    }
}
