//! `/operate`: a page on which a person starts an episode or drives one robot. It holds nothing but script and style, so everybody may
//! read it; what it asks for comes by REST, with the token of a robot's operator.

use axum::{
    Router,
    http::header,
    response::{Html, IntoResponse, Response},
    routing::get,
};

use super::{POLICY, STYLE, asset};
use crate::http::app::AppState;

/// Where the page is.
pub const OPERATE: &str = "/operate";

const SHELL: &str = include_str!("../../../web/operators/page.html");

/// The modules of the page, by their paths below it, which are as in `gateway/web`.
const MODULES: [(&str, &str); 7] = [
    ("/operators/main.js", include_str!("../../../web/operators/main.js")),
    ("/operators/start.js", include_str!("../../../web/operators/start.js")),
    ("/operators/drive.js", include_str!("../../../web/operators/drive.js")),
    ("/operators/call.js", include_str!("../../../web/operators/call.js")),
    ("/operators/camera.js", include_str!("../../../web/operators/camera.js")),
    ("/operators/inputs.js", include_str!("../../../web/operators/inputs.js")),
    ("/src/dom.js", include_str!("../../../web/src/dom.js")),
];

/// The routes of the page.
pub fn router() -> Router<AppState> {
    let shell = Router::new()
        .route(OPERATE, get(page))
        .route("/operate/page.css", get(async || asset("text/css; charset=utf-8", STYLE)));
    MODULES.iter().fold(shell, |router, &(path, text)| {
        let module = async move || asset("text/javascript; charset=utf-8", text);
        router.route(&format!("{OPERATE}{path}"), get(module))
    })
}

/// Whether a path is of the page, which anybody may read.
pub fn is_open(path: &str) -> bool {
    path.strip_prefix(OPERATE).is_some_and(|rest| {
        matches!(rest, "" | "/page.css") || MODULES.iter().any(|(module, _)| *module == rest)
    })
}

async fn page() -> Response {
    ([(header::CONTENT_SECURITY_POLICY, POLICY)], Html(SHELL)).into_response()
}
