//! The whole service: REST and MCP behind the gate. Every request is logged, and every refusal is
//! described and counted.

use axum::{
    Router,
    extract::{DefaultBodyLimit, MatchedPath, Request, State},
    http::{HeaderMap, HeaderValue, Method, Uri, header},
    middleware::{self, Next},
    response::{IntoResponse, Response},
};

use super::{
    app::AppState,
    gate::{
        self, Gate,
        limits::{self, Limits},
        tokens,
    },
    mcp, pages,
    problem::{ApiError, Elsewhere, RefusalKind},
    rest,
};

/// Builds the router of the whole service.
pub fn router(app: AppState, gate: Gate, limits: Limits) -> Router {
    // In an evaluation, only the policy drives the robots.
    let operating = if app.table.is_evaluation() { Router::new() } else { pages::operate::router() };
    let routed = rest::router()
        .merge(pages::router())
        .merge(pages::home::router())
        .merge(operating)
        .nest_service("/mcp", mcp::router(app.clone()))
        .fallback(no_route)
        .method_not_allowed_fallback(no_method)
        // The gate has its own limit on bodies.
        .layer(DefaultBodyLimit::disable())
        .layer(middleware::from_fn_with_state(limits.clone(), limits::take_place))
        .layer(middleware::from_fn_with_state(gate, gate::pass))
        .layer(middleware::from_fn_with_state(app.clone(), log_and_describe))
        .with_state(app.clone());
    // This layer is outermost, because axum's own additions to an answer, such as the methods of a path,
    // would reveal which paths exist.
    Router::new()
        .fallback_service(routed)
        .layer(middleware::from_fn_with_state(app.clone(), tokens::identify))
        // The rate limit comes first, so that tokens cannot be tried faster than requests are admitted.
        .layer(middleware::from_fn_with_state(limits, limits::pass_rate))
        .layer(middleware::from_fn_with_state(app, count_refusal))
}

async fn no_route(State(app): State<AppState>, method: Method, uri: Uri) -> ApiError {
    refused_route(&app, method, uri, false)
}

async fn no_method(State(app): State<AppState>, method: Method, uri: Uri) -> ApiError {
    refused_route(&app, method, uri, true)
}

fn refused_route(app: &AppState, method: Method, uri: Uri, other_method: bool) -> ApiError {
    let operating = (!app.table.is_evaluation()).then_some(pages::operate::OPERATE);
    let pages = [pages::WATCH].into_iter().chain(operating).map(|page| format!("GET {page}"));
    let have = rest::served().into_iter().chain(["POST /mcp".into()]).chain(pages).collect();
    ApiError::NoRoute { method: method.to_string(), path: uri.path().into(), have, other_method }
}

/// Counts every refusal, whichever layer it comes from.
async fn count_refusal(State(app): State<AppState>, request: Request, next: Next) -> Response {
    let response = next.run(request).await;
    if let Some(RefusalKind(kind)) = response.extensions().get() {
        app.table.metrics().request_refused(kind);
    }
    response
}

/// Logs every request, and turns axum's own refusals into problem details, for example for a path that is
/// not UTF-8.
///
/// The log contains only the route and the id of an existing episode, because any other text from the caller
/// may be a secret.
async fn log_and_describe(State(app): State<AppState>, request: Request, next: Next) -> Response {
    let method = request.method().clone();
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let episode = episode_of(request.uri().path()).filter(|id| app.table.get(id).is_ok()).map(str::to_owned);
    let asked = request.uri().path_and_query().map(|path| path.as_str().to_owned()).unwrap_or_default();
    let began = std::time::Instant::now();
    let mut response = next.run(request).await;
    if let Some(Elsewhere(url)) = response.extensions().get()
        && let Ok(location) = HeaderValue::try_from(format!("{url}{asked}"))
    {
        response.headers_mut().insert(header::LOCATION, location);
    }
    let status = response.status();
    if status.is_client_error() && !is_json(response.headers()) {
        let allow = response.headers().get(header::ALLOW).cloned();
        let text = axum::body::to_bytes(response.into_body(), 10_000).await.unwrap_or_default();
        let detail = format!("{}; see GET /v1/tools for what is served", String::from_utf8_lossy(&text));
        response = ApiError::Protocol { status, detail }.into_response();
        response.headers_mut().extend(allow.map(|methods| (header::ALLOW, methods)));
    }
    let problem = response.extensions().get().map(|RefusalKind(kind)| *kind);
    let ms = began.elapsed().as_millis() as u64;
    tracing::info!(%method, route, episode, status = status.as_u16(), problem, ms, "request");
    response
}

/// Returns the episode id in a path.
fn episode_of(path: &str) -> Option<&str> {
    path.strip_prefix("/v1/episodes/")?.split('/').next()
}

fn is_json(headers: &HeaderMap) -> bool {
    let content_type = headers.get(header::CONTENT_TYPE);
    content_type.is_some_and(|value| value.to_str().is_ok_and(|text| text.contains("json")))
}
