//! Resources that MCP hosts may read: an episode's briefing, the brief of the server, and pages of the book.
//! No tool repeats the briefing or the brief.

use std::sync::Arc;

use rmcp::{
    ErrorData,
    model::{ReadResourceResult, Resource, ResourceContents},
};
use tandem_episodes::brief;
use tandem_tools_spec::{Assistance, ImageLink, Png};

use crate::{
    hosting::Caller,
    http::{app::AppState, problem::ApiError},
};

/// Beginning of the URIs of images to which replies link. The rest of a URI equals the rest of the image's
/// path.
const IMAGES: &str = "tandem://episodes/";
/// The brief of every episode.
const BRIEF: &str = "tandem://brief";
/// The briefing of the operator's own episode.
const BRIEFING: &str = "tandem://briefing";

/// Page of the book: URI, title, text.
type Page = (&'static str, &'static str, &'static str);

/// Pages of the book for policies with full assistance.
const PAGES: [Page; 2] = [
    ("tandem://book/tools", "Tools and their replies", include_str!("../../../../docs/src/tools.md")),
    ("tandem://book/concepts", "Concepts", include_str!("../../../../docs/src/concepts.md")),
];
/// The page for operators.
const OPERATORS: Page = (
    "tandem://book/operators",
    "An operator for each robot",
    include_str!("../../../../docs/src/operators.md"),
);

/// Returns the resources that `caller` may read.
pub fn resources(app: &AppState, caller: &Caller) -> Vec<Resource> {
    let brief = Resource::new(BRIEF, "brief")
        .with_description("Frames, cameras, hands, walking and grips, as start_episode tells them")
        .with_mime_type("text/plain");
    let briefing = matches!(caller, Caller::Operator { .. }).then(|| {
        Resource::new(BRIEFING, "briefing")
            .with_description("Your episode: your part, the robots, the room, the brief and the budget")
            .with_mime_type("application/json")
    });
    let page = |(uri, title, text): Page| {
        let kb = text.len().div_ceil(1000);
        Resource::new(uri, title)
            .with_description(format!("{kb} kB for people who write programs; players need none of it"))
            .with_mime_type("text/markdown")
    };
    let pages = pages(app, caller).into_iter().map(page);
    [brief].into_iter().chain(briefing).chain(pages).collect()
}

/// Returns the resource of a linked image.
pub fn image(link: &ImageLink) -> Resource {
    let uri = link.path.replacen("/v1/episodes/", IMAGES, 1);
    let name = format!("image of {}", link.robot);
    Resource::new(uri, name).with_mime_type("image/png")
}

/// Returns the linked image of this URI, or `None` if the URI is not a link to an image.
fn read_image(app: &AppState, caller: &Caller, uri: &str) -> Option<Result<ReadResourceResult, ErrorData>> {
    let (id, name) = uri.strip_prefix(IMAGES)?.split_once("/images/")?;
    let png = app.table.hosted(id).and_then(|hosted| hosted.image(caller, name)).map_err(ApiError::from);
    let blob = |png: Arc<[u8]>| {
        let contents = ResourceContents::blob(Png(png.to_vec()).to_base64(), uri);
        ReadResourceResult::new(vec![contents.with_mime_type("image/png")])
    };
    Some(png.map(blob).map_err(|error| ErrorData::resource_not_found(error.body().detail, None)))
}

/// Reads a resource.
///
/// # Errors
/// Fails if `caller` may read no resource with this URI.
pub async fn read(app: &AppState, caller: &Caller, uri: &str) -> Result<ReadResourceResult, ErrorData> {
    if let Some(image) = read_image(app, caller, uri) {
        return image;
    }
    let text = match (uri, caller) {
        (BRIEF, _) => {
            let limits = app.table.task_list().base_limits;
            brief(app.settings.wording(), &limits, app.settings.camera, None).lines().join("\n\n")
        }
        (BRIEFING, Caller::Operator { episode, .. }) => {
            let briefing = app.table.briefing(episode, caller).await.map_err(ApiError::from);
            let briefing = briefing.map_err(|error| ErrorData::internal_error(error.to_string(), None))?;
            serde_json::to_string(&briefing.shortened())
                .map_err(|error| ErrorData::internal_error(error.to_string(), None))?
        }
        _ => match pages(app, caller).into_iter().find(|(known, ..)| *known == uri) {
            Some((.., text)) => text.to_owned(),
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

/// Returns the pages that policies of this server may read: they describe information that only `full`
/// includes.
fn pages(app: &AppState, caller: &Caller) -> Vec<Page> {
    let of_operators = matches!(caller, Caller::Operator { .. }).then_some(OPERATORS);
    match app.settings.assistance {
        Assistance::Full => PAGES.into_iter().chain(of_operators).collect(),
        Assistance::Paper => Vec::new(),
    }
}
