//! Resources that MCP hosts may read: an episode's briefing and the brief of the server, as tools do not
//! repeat them, and pages of the book.

use rmcp::{
    ErrorData,
    model::{ReadResourceResult, Resource, ResourceContents},
};
use tandem_episodes::brief;
use tandem_tools_spec::Assistance;

use crate::{
    hosting::Caller,
    http::{app::AppState, problem::ApiError},
};

/// The brief of every episode.
const BRIEF: &str = "tandem://brief";
/// The briefing of the operator's own episode.
const BRIEFING: &str = "tandem://briefing";

/// Pages of the book for policies with full assistance: URI, title, text.
const PAGES: [(&str, &str, &str); 4] = [
    ("tandem://book/tools", "Tools and their replies", include_str!("../../../../docs/src/tools.md")),
    ("tandem://book/concepts", "Concepts", include_str!("../../../../docs/src/concepts.md")),
    (
        "tandem://book/agents",
        "Running language models (for programs that play with one; no player needs it)",
        include_str!("../../../../docs/src/agents.md"),
    ),
    (
        "tandem://book/operators",
        "An operator for each robot",
        include_str!("../../../../docs/src/operators.md"),
    ),
];

/// Returns the resources that `caller` may read.
pub fn resources(app: &AppState, caller: &Caller) -> Vec<Resource> {
    let brief = Resource::new(BRIEF, "brief")
        .with_description("Frames, cameras, hands, walking and grips that work")
        .with_mime_type("text/plain");
    let briefing = matches!(caller, Caller::Operator { .. }).then(|| {
        Resource::new(BRIEFING, "briefing")
            .with_description("Your episode: your part, the robots, the room, the brief and the budget")
            .with_mime_type("application/json")
    });
    let page =
        |(uri, title, _): &(&str, &str, &str)| Resource::new(*uri, *title).with_mime_type("text/markdown");
    let pages = pages(app).iter().map(page);
    [brief].into_iter().chain(briefing).chain(pages).collect()
}

/// Reads a resource.
///
/// # Errors
/// If there is none of this URI for `caller`.
pub async fn read(app: &AppState, caller: &Caller, uri: &str) -> Result<ReadResourceResult, ErrorData> {
    let text = match (uri, caller) {
        (BRIEF, _) => {
            let limits = app.table.task_list().base_limits;
            brief(app.settings.wording(), &limits, None).lines().join("\n\n")
        }
        (BRIEFING, Caller::Operator { episode, .. }) => {
            let briefing = app.table.briefing(episode, caller).await.map_err(ApiError::from);
            let briefing = briefing.map_err(|error| ErrorData::internal_error(error.to_string(), None))?;
            serde_json::to_string(&briefing.shortened())
                .map_err(|error| ErrorData::internal_error(error.to_string(), None))?
        }
        _ => match pages(app).iter().find(|(known, ..)| *known == uri) {
            Some((.., text)) => (*text).to_owned(),
            None => {
                let have: Vec<String> =
                    resources(app, caller).into_iter().map(|resource| resource.uri).collect();
                let text = format!("no resource {uri:?}; have: {}", have.join(", "));
                return Err(ErrorData::resource_not_found(text, None));
            }
        },
    };
    Ok(ReadResourceResult::new(vec![ResourceContents::text(text, uri)]))
}

/// Returns the pages that policies of this server may read: they speak of what only `full` tells.
fn pages(app: &AppState) -> &'static [(&'static str, &'static str, &'static str)] {
    match app.settings.assistance {
        Assistance::Full => &PAGES,
        Assistance::Paper => &[],
    }
}
