//! The REST interface as OpenAPI 3.1, generated from the types that read and write it.

use serde_json::{Map, Value, json};

use super::format::Format;
use super::plain::{body_schema, plain_schema};
use super::spec::ToolSpec;
use crate::limits::MAX_STEPS;
use crate::listing::EpisodeList;
use crate::parts::{Heard, Hints, Note, Partner, Presence, Wording};
use crate::refusal::ProblemBody;
use crate::tool::Tool;
use crate::tools::{Briefing, Finish, GetStatus, StartEpisode};

/// Returns the document of a server of `version` with these tools. Each tool has a separate path, so that
/// generated clients have a method for each tool.
pub fn openapi(version: &str, tools: &[ToolSpec]) -> Value {
    let mut paths = paths_without_tools();
    for spec in tools {
        let mut path = json!({ (spec.route.method.to_lowercase()): tool(spec) });
        if spec.on_episode {
            path["parameters"] = json!([episode_id()]);
        }
        paths.insert(spec.route.path.clone(), path);
    }
    paths["/v1/episodes"]["get"] = list_episodes();
    let status = with_notice(plain_schema::<<GetStatus as Tool>::Reply>());
    let result = plain_schema::<<Finish as Tool>::Reply>();
    let briefing = "What has to be known to play the episode, as its start said it; for the operator of a robot, its own part.";
    let briefing = operation("episode_briefing", briefing, "200", plain_schema::<Briefing>());
    paths.insert(
        "/v1/episodes/{episode_id}/briefing".into(),
        json!({ "parameters": [episode_id()], "get": briefing }),
    );
    paths.insert(
        "/v1/episodes/{episode_id}".into(),
        json!({
            "parameters": [episode_id()],
            "get": operation("episode_status", "Where the episode stands.", "200", status),
            "delete": operation("delete_episode", "End the episode, close its recording and forget it.", "200", result),
        }),
    );
    paths.insert(
        "/v1/episodes/{episode_id}/notes".into(),
        json!({ "parameters": [episode_id()], "post": note() }),
    );
    json!({
        "openapi": "3.1.0",
        "info": { "title": "Tandem", "version": version },
        "paths": paths,
        "components": { "schemas": { "Problem": plain_schema::<ProblemBody>() } },
    })
}

fn tool(spec: &ToolSpec) -> Value {
    let reply = spec.reply_schema.clone();
    let reply = if spec.on_episode { with_notice(reply) } else { reply };
    let success = if spec.name == StartEpisode::NAME { "201" } else { "200" };
    let mut call = operation(spec.name, &spec.description, success, reply);
    if spec.route.method == "POST" {
        call["requestBody"] = json_body(spec.body_schema(MAX_STEPS));
    }
    call
}

/// Describes the operation that adds a note; its response has no body.
fn note() -> Value {
    let mut schema = body_schema::<Note>(Wording::from(Hints::On));
    schema["anyOf"] = Note::conditions();
    let description = schema["description"].as_str().unwrap_or_default().to_owned();
    let mut note = operation("note", &description, "204", Value::Null);
    note["responses"]["204"] = json!({ "description": "Kept." });
    note["requestBody"] = json_body(schema);
    note
}

fn paths_without_tools() -> Map<String, Value> {
    let health = json!({ "type": "object", "description": "The server answers." });
    let health = operation("health", "Whether the server answers.", "200", health);
    let specs = json!({ "type": "array", "items": { "type": "object" } });
    let of_episode = "The tools of a running episode: each with its route and with the schema of its body, which says how \
        many control steps the episode's protocol allows for one command.";
    let of_episode = operation("list_episode_tools", of_episode, "200", specs.clone());
    let home = page("home", "A page with the episodes that the caller may know of, and where to go on.");
    let docs = page("docs", "This description as a page.");
    let metrics =
        text("metrics", "What the server has done and does, in the text format of Prometheus.", "text/plain");
    let of_image = "The PNG file of a picture to which a reply links: one of the latest of its episode.";
    let mut image = operation("episode_image", of_image, "200", Value::Null);
    image["responses"]["200"]["content"] = json!({ "image/png": {} });
    let name = json!({ "name": "name", "in": "path", "required": true, "schema": { "type": "string" } });
    let paths = [
        ("/", json!({ "get": home })),
        ("/healthz", json!({ "get": health })),
        ("/metrics", json!({ "get": metrics })),
        ("/docs", json!({ "get": docs })),
        ("/v1/tools", json!({ "get": list_tools(specs) })),
        (
            "/v1/episodes/{episode_id}/images/{name}",
            json!({ "parameters": [episode_id(), name], "get": image }),
        ),
        ("/v1/episodes/{episode_id}/tools", json!({ "parameters": [episode_id()], "get": of_episode })),
    ];
    paths.into_iter().map(|(path, methods)| (path.into(), methods)).collect()
}

fn list_episodes() -> Value {
    let list = "The episodes that the server holds, as far as they are the caller's business: for the operator of a robot, its own.";
    operation("list_episodes", list, "200", plain_schema::<EpisodeList>())
}

fn list_tools(specs: Value) -> Value {
    let tools =
        "The tools as specifications for language models, which name the episode among the arguments.";
    let mut list = operation("list_tools", tools, "200", specs);
    list["parameters"] = json!([{
        "name": "format",
        "in": "query",
        "required": false,
        "description": "The form that the SDKs of OpenAI (Responses, or Chat Completions) and Anthropic take as it is, or that of \
            MCP. Left out: one form with the route of each tool.",
        "schema": { "type": "string", "enum": Format::ALL.map(Format::name) },
    }]);
    list
}

/// Describes an HTML page. Clients that do not accept `text/html` get a few lines of text.
fn page(id: &str, description: &str) -> Value {
    let description =
        format!("{description} For a call that does not accept text/html, a few lines of text.");
    let mut operation = text(id, &description, "text/html");
    operation["responses"]["200"]["content"]["text/plain"] = json!({ "schema": { "type": "string" } });
    operation
}

/// Describes a text response, which has no schema.
fn text(id: &str, description: &str, kind: &str) -> Value {
    let mut operation = operation(id, description, "200", Value::Null);
    operation["responses"]["200"]["content"] = json!({ (kind): { "schema": { "type": "string" } } });
    operation
}

fn operation(id: &str, description: &str, success: &str, reply: Value) -> Value {
    json!({
        "operationId": id,
        "description": description,
        "responses": {
            success: { "description": "Done.", "content": { "application/json": { "schema": reply } } },
            "default": {
                "description": "Refused; the detail says what would work.",
                "content": { "application/problem+json": { "schema": { "$ref": "#/components/schemas/Problem" } } },
            },
        },
    })
}

/// Adds the episode's step and a failure of its recording to a reply of an episode. Operators of single
/// robots also get the states and messages of the others.
fn with_notice(mut reply: Value) -> Value {
    let list =
        |of: Value, description: &str| json!({ "type": "array", "items": of, "description": description });
    reply["properties"]["step"] = json!({
        "type": "integer",
        "description": "Control steps executed so far, the initial hold included: what expected_step is compared with.",
    });
    reply["properties"]["partners"] = list(
        plain_schema::<Partner>(),
        "What the robots of the other operators did meanwhile; left out where one policy directs all.",
    );
    reply["properties"]["presence"] = list(
        plain_schema::<Presence>(),
        "What the other operators do at the moment; in replies to get_status alone.",
    );
    reply["properties"]["heard"] = list(
        plain_schema::<Heard>(),
        "What the other operators have said since the last reply; left out where they have said nothing.",
    );
    reply["properties"]["others_play_on"] = json!({
        "type": "boolean",
        "description": "True once an operator has called finish and others play on; left out otherwise.",
    });
    reply["properties"]["recording_failed"] = json!({
        "type": ["string", "null"],
        "description": "Why the recording is not complete; left out where it is.",
    });
    reply
}

/// Makes a body optional if none of its fields is required.
fn json_body(schema: Value) -> Value {
    let required = schema["required"].as_array().is_some_and(|fields| !fields.is_empty());
    json!({ "required": required, "content": { "application/json": { "schema": schema } } })
}

fn episode_id() -> Value {
    json!({
        "name": "episode_id",
        "in": "path",
        "required": true,
        "description": "The episode, as start_episode returned it.",
        "schema": { "type": "string" },
    })
}
