//! The REST routes under `/v1`.

mod docs;
mod idempotency;

use axum::{
    Json, Router,
    body::Bytes,
    extract::{DefaultBodyLimit, Extension, MatchedPath, Path, Query, Request, State},
    http::{HeaderMap, Method, StatusCode, Uri, header},
    middleware::{self, Next},
    response::{Html, IntoResponse, Response},
    routing::{MethodRouter, get, post},
};
use serde::Deserialize;
use serde_json::{Value, json};
use tandem_tools_spec::{
    EpisodeToolSpec, Format, ResultReply, StartEpisode, TaskList, Tool as _, episode_tool_specs, parse_start,
    say_spec, tool_specs,
};

use super::{
    app::App,
    counted::counted,
    encoding::Encoding,
    gate::{
        self, Gate,
        limits::{self, Limits},
        tokens,
    },
    mcp,
    problem::{ApiError, Refused},
};
use crate::{
    hosting::{Caller, HostingError, Once, Request as Asked},
    metrics::MetricsPage,
};
use idempotency::{Key, say_again};

/// Every route: path, methods, handlers.
fn routes() -> [(&'static str, &'static [&'static str], MethodRouter<App>); 11] {
    [
        ("/healthz", &["GET"], get(health)),
        ("/metrics", &["GET"], get(metrics)),
        ("/docs", &["GET"], get(docs)),
        ("/v1/tasks", &["GET"], get(tasks)),
        ("/v1/tools", &["GET"], get(tools)),
        ("/v1/openapi.json", &["GET"], get(openapi)),
        ("/v1/episodes", &["POST"], post(start)),
        ("/v1/episodes/{id}", &["GET", "DELETE"], get(status).delete(remove)),
        ("/v1/episodes/{id}/briefing", &["GET"], get(briefing)),
        ("/v1/episodes/{id}/tools", &["GET"], get(episode_tools)),
        ("/v1/episodes/{id}/tools/{name}", &["POST"], post(call)),
    ]
}

/// The whole service.
pub fn router(app: App, gate: Gate, limits: Limits) -> Router {
    let mut router = Router::new().nest_service("/mcp", mcp::router(app.clone()));
    for (path, _, handlers) in routes() {
        router = router.route(path, handlers);
    }
    let routed = router
        .fallback(no_route)
        .method_not_allowed_fallback(no_method)
        // The gate has a limit of its own.
        .layer(DefaultBodyLimit::disable())
        .layer(middleware::from_fn_with_state(gate, gate::pass))
        .layer(middleware::from_fn_with_state(app.clone(), log_and_describe))
        .with_state(app.clone());
    // Around all of it: what axum itself adds to an answer, as the methods of a path, would say which paths there are.
    Router::new()
        .fallback_service(routed)
        .layer(middleware::from_fn_with_state(app.clone(), tokens::identify))
        // Before it, so that nobody tries tokens faster than requests are let in.
        .layer(middleware::from_fn_with_state(limits, limits::pass))
        .layer(middleware::from_fn_with_state(app, count_refusal))
}

async fn health(State(app): State<App>) -> Json<Value> {
    Json(json!({ "status": "ok", "version": env!("CARGO_PKG_VERSION"), "episodes": app.table.len() }))
}

async fn tasks(State(app): State<App>) -> Json<TaskList> {
    Json(app.table.task_list())
}

/// What `GET /v1/tools` may be asked for.
#[derive(Debug, Deserialize)]
struct ToolsQuery {
    format: Option<String>,
}

async fn tools(State(app): State<App>, Query(query): Query<ToolsQuery>) -> Result<Json<Value>, ApiError> {
    let specs = tool_specs(app.settings.hints);
    let Some(name) = query.format else { return Ok(Json(json!(specs))) };
    let format = Format::find(&name).ok_or(ApiError::UnknownFormat { name })?;
    Ok(Json(specs.iter().map(|spec| spec.formatted(format)).collect()))
}

async fn episode_tools(
    State(app): State<App>,
    Extension(who): Extension<Caller>,
    Path(id): Path<String>,
) -> Result<Json<Vec<EpisodeToolSpec>>, ApiError> {
    let episode = app.table.hosted(&id)?;
    episode.admit(&who)?;
    let (hints, most_steps) = (app.settings.hints, episode.thread.steps_per_command());
    let mut specs = episode_tool_specs(hints, &id, most_steps);
    specs.extend(episode.may_talk().then(|| say_spec(hints, &id)));
    Ok(Json(specs))
}

async fn openapi(State(app): State<App>) -> Json<Value> {
    Json(tandem_tools_spec::openapi(env!("CARGO_PKG_VERSION"), app.settings.hints))
}

/// The description of the interface as a page, which needs and may load nothing else.
async fn docs(State(app): State<App>) -> Response {
    let document = tandem_tools_spec::openapi(env!("CARGO_PKG_VERSION"), app.settings.hints);
    let policy = (header::CONTENT_SECURITY_POLICY, "default-src 'none'; style-src 'unsafe-inline'");
    ([policy], Html(docs::page(&document))).into_response()
}

async fn metrics(State(app): State<App>, Extension(who): Extension<Caller>) -> Result<Response, ApiError> {
    only_hosts(&who)?;
    let page = app.table.metrics().page(app.table.len(), app.table.running());
    Ok(([(header::CONTENT_TYPE, MetricsPage::CONTENT_TYPE)], page).into_response())
}

async fn start(
    State(app): State<App>,
    Extension(who): Extension<Caller>,
    encoding: Encoding,
    Key(key): Key,
    body: Bytes,
) -> Result<Response, ApiError> {
    counted(&app, StartEpisode::NAME, async {
        only_hosts(&who)?;
        let (args, driving) = parse_start(encoding.read(&body)?)?;
        let Once { reply, again } = match key {
            Some(key) => app.table.start_once(args, driving, &key).await?,
            None => Once { reply: app.table.start_driven(args, driving).await?, again: false },
        };
        let location = format!("/v1/episodes/{}", reply.episode_id);
        let written = encoding.write(StatusCode::CREATED, &reply)?;
        Ok(say_again(([(header::LOCATION, location)], written).into_response(), again))
    })
    .await
}

async fn status(
    State(app): State<App>,
    Extension(who): Extension<Caller>,
    encoding: Encoding,
    Path(id): Path<String>,
) -> Result<Response, ApiError> {
    encoding.write(StatusCode::OK, &app.table.hosted(&id)?.status(&who).await?)
}

async fn briefing(
    State(app): State<App>,
    Extension(who): Extension<Caller>,
    encoding: Encoding,
    Path(id): Path<String>,
) -> Result<Response, ApiError> {
    encoding.write(StatusCode::OK, &app.table.briefing(&id, &who).await?)
}

async fn call(
    State(app): State<App>,
    Extension(who): Extension<Caller>,
    encoding: Encoding,
    Key(key): Key,
    Path((id, name)): Path<(String, String)>,
    body: Bytes,
) -> Result<Response, ApiError> {
    counted(&app, &name, async {
        let episode = app.table.hosted(&id)?;
        episode.admit(&who)?;
        let read = || Ok(Asked::parse(&name, without_episode_id(encoding.read(&body)?, &id)?)?);
        let answer = match read() {
            Ok(request) => episode.call(&who, request, key.as_deref()).await.map_err(ApiError::from),
            Err(refusal) => Err(refusal),
        };
        let Once { reply, again } = answer.map_err(|refusal: ApiError| refusal.of(&episode.thread))?;
        let status = if reply.others_play_on { StatusCode::ACCEPTED } else { StatusCode::OK };
        Ok(say_again(encoding.write(status, &*reply)?, again))
    })
    .await
}

async fn remove(
    State(app): State<App>,
    Extension(who): Extension<Caller>,
    Path(id): Path<String>,
) -> Result<Json<ResultReply>, ApiError> {
    app.table.hosted(&id)?.admit(&who)?;
    only_hosts(&who)?;
    Ok(Json(app.table.remove(&id).await?))
}

/// Operators drive their robots; what concerns the whole is for who started the episode.
fn only_hosts(who: &Caller) -> Result<(), HostingError> {
    match who {
        Caller::Host => Ok(()),
        Caller::Operator { .. } => Err(HostingError::HostsBusiness),
    }
}

/// Clients made for MCP send `episode_id` among the arguments; that is fine as long as it is the path's.
fn without_episode_id(mut args: Value, id: &str) -> Result<Value, ApiError> {
    match args.as_object_mut().and_then(|object| object.shift_remove("episode_id")) {
        Some(body) if body != id => {
            Err(ApiError::EpisodeMismatch { path: id.into(), body: body.to_string() })
        }
        _ => Ok(args),
    }
}

async fn no_route(method: Method, uri: Uri) -> ApiError {
    refused_route(method, uri, false)
}

async fn no_method(method: Method, uri: Uri) -> ApiError {
    refused_route(method, uri, true)
}

fn refused_route(method: Method, uri: Uri, other_method: bool) -> ApiError {
    let have = routes()
        .iter()
        .map(|(path, methods, _)| format!("{} {path}", methods.join("|")))
        .chain(["POST /mcp".into()])
        .collect();
    ApiError::NoRoute { method: method.to_string(), path: uri.path().into(), have, other_method }
}

/// Counts what is refused, wherever that was.
async fn count_refusal(State(app): State<App>, request: Request, next: Next) -> Response {
    let response = next.run(request).await;
    if let Some(Refused(kind)) = response.extensions().get() {
        app.table.metrics().request_refused(kind);
    }
    response
}

/// Logs every request, and turns refusals of axum's own (as of a path that is not UTF-8) into problem details. Of what
/// a caller wrote, the log has the route, and the episode where there is such an episode: whatever else there is may be a secret.
async fn log_and_describe(State(app): State<App>, request: Request, next: Next) -> Response {
    let method = request.method().clone();
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let episode = episode_of(request.uri().path()).filter(|id| app.table.get(id).is_ok()).map(str::to_owned);
    let began = std::time::Instant::now();
    let mut response = next.run(request).await;
    let status = response.status();
    if status.is_client_error() && !is_json(response.headers()) {
        let allow = response.headers().get(header::ALLOW).cloned();
        let text = axum::body::to_bytes(response.into_body(), 10_000).await.unwrap_or_default();
        let detail = format!("{}; see GET /v1/tools for what is served", String::from_utf8_lossy(&text));
        response = ApiError::Protocol { status, detail }.into_response();
        response.headers_mut().extend(allow.map(|methods| (header::ALLOW, methods)));
    }
    let problem = response.extensions().get().map(|Refused(kind)| *kind);
    let ms = began.elapsed().as_millis() as u64;
    tracing::info!(%method, route, episode, status = status.as_u16(), problem, ms, "request");
    response
}

/// What a path names as the episode.
fn episode_of(path: &str) -> Option<&str> {
    path.strip_prefix("/v1/episodes/")?.split('/').next()
}

fn is_json(headers: &HeaderMap) -> bool {
    let content_type = headers.get(header::CONTENT_TYPE);
    content_type.is_some_and(|value| value.to_str().is_ok_and(|text| text.contains("json")))
}
