//! Identification of callers by the server's token or an operator's token. A server without a token
//! admits every request that passes the gate. A caller without a required token learns only that it needs
//! one.

use axum::{
    body::Body,
    extract::{Request, State},
    http::{HeaderMap, StatusCode, header},
    middleware::Next,
    response::{IntoResponse, Response},
};

use super::waiting::GoodCall;
use crate::{
    hosting::Caller,
    http::{
        app::AppState,
        pages::{
            WATCH, door,
            drive::{DRIVE, ENTER, GivenToken, drivers},
            home, operate,
        },
        problem::ApiError,
        watching::{Host, Watcher},
    },
};

/// Adds the [`Caller`] to a request and removes the token.
pub async fn identify(State(app): State<AppState>, mut request: Request, next: Next) -> Response {
    let watches = is_watching(request.uri().path()) && app.watch_key.opens(request.headers());
    // The start page and the operators' page have only public content.
    if operate::is_open(request.uri().path()) || home::is_open(request.uri().path(), request.headers()) {
        request.headers_mut().remove(header::COOKIE);
        request.headers_mut().remove(header::AUTHORIZATION);
        // No page reads a body, so it is not awaited.
        *request.body_mut() = Body::empty();
        request.headers_mut().remove(header::CONTENT_TYPE);
        return next.run(request).await;
    }
    let driving = match request.uri().query().filter(|_| path_is(&request, DRIVE)) {
        Some(query) => drivers(&app, query, request.headers()).await,
        None => None,
    };
    if let Some((_, robots)) = &driving {
        request.extensions_mut().insert(robots.clone());
    }
    let driver = driving.map(|(caller, _)| caller);
    let by_token = match driver {
        Some(driver) => Some(driver),
        None => caller(&app, request.headers()).await,
    };
    if by_token == Some(Caller::Host) {
        request.extensions_mut().insert(Host);
    }
    let caller = by_token.or(watches.then_some(Caller::Host));
    let Some(caller) = caller else {
        tracing::info!("a request without a token was refused");
        return refused(request.headers());
    };
    if watches {
        request.extensions_mut().insert(Watcher);
    }
    if let Some(token) = bearer(request.headers()).filter(|_| path_is(&request, ENTER)) {
        let given = GivenToken(token.into());
        request.extensions_mut().insert(given);
    }
    request.headers_mut().remove(header::COOKIE);
    request.headers_mut().remove(header::AUTHORIZATION);
    request.extensions_mut().insert(caller);
    let mut answer = next.run(request).await;
    if answer.status().is_success() {
        answer.extensions_mut().insert(GoodCall);
    }
    answer
}

fn path_is(request: &Request, path: &str) -> bool {
    request.uri().path() == path
}

/// Returns true for paths that require the watch link instead of a token.
fn is_watching(path: &str) -> bool {
    path.strip_prefix(WATCH).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

/// Returns the refusal for a missing token, the same for every path. Browsers get a page that reads the
/// watch link.
fn refused(headers: &HeaderMap) -> Response {
    let accepts = headers.get(header::ACCEPT).and_then(|value| value.to_str().ok()).unwrap_or_default();
    match accepts.contains("text/html") {
        true => door(StatusCode::UNAUTHORIZED),
        false => ApiError::NoToken.into_response(),
    }
}

async fn caller(app: &AppState, headers: &HeaderMap) -> Option<Caller> {
    let token = bearer(headers);
    let is_hosts = |token| app.settings.token.as_ref().is_some_and(|expected| expected.matches(token));
    let operator = match token {
        Some(token) if !is_hosts(token) => app.table.operator_anywhere(token).await,
        _ => None,
    };
    match (&app.settings.token, token) {
        (Some(_), Some(token)) => operator.or_else(|| is_hosts(token).then_some(Caller::Host)),
        (Some(_), None) => None,
        // If the server has no token, unknown tokens are ignored.
        (None, _) => operator.or(Some(Caller::Host)),
    }
}

/// Returns the token of a request that has exactly one.
fn bearer(headers: &HeaderMap) -> Option<&str> {
    let mut values = headers.get_all(header::AUTHORIZATION).iter();
    let (value, None) = (values.next()?.to_str().ok()?, values.next()) else { return None };
    let (scheme, token) = value.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_are_found() {
        let found = |values: &[&str]| {
            let mut headers = HeaderMap::new();
            for value in values {
                headers.append(header::AUTHORIZATION, value.parse().unwrap());
            }
            bearer(&headers).map(str::to_owned)
        };
        assert_eq!(found(&["Bearer abc"]).as_deref(), Some("abc"));
        assert_eq!(found(&["bearer  abc "]).as_deref(), Some("abc"));
        for values in [&[][..], &["abc"], &["Basic abc"], &["Bearerabc"], &["Bearer abc", "Bearer def"]] {
            assert_eq!(found(values), None, "{values:?}");
        }
    }
}
