//! The REST interface as OpenAPI 3.1, from the same types that read and write it.

use serde_json::{Map, Value, json};

use crate::{
    Finish, GetStatus, ListTasks, ProblemBody, StartEpisode, Tool, ToolSpec, schema::plain_schema, tool_specs,
};

/// The document. Each tool has a path of its own, so that generated clients have a method for each.
pub fn openapi(version: &str) -> Value {
    let mut paths = Map::new();
    let health = json!({ "type": "object", "description": "The server answers." });
    paths.insert(
        "/healthz".into(),
        json!({ "get": operation("health", "Whether the server answers.", "200", health) }),
    );
    let specs = json!({ "type": "array", "items": { "type": "object" } });
    let tools =
        "The tools as specifications for language models, which name the episode among the arguments.";
    paths.insert("/v1/tools".into(), json!({ "get": operation("list_tools", tools, "200", specs) }));
    for spec in tool_specs() {
        match spec.name {
            ListTasks::NAME => {
                let list = operation(spec.name, &spec.description, "200", spec.reply_schema);
                paths.insert("/v1/tasks".into(), json!({ "get": list }));
            }
            StartEpisode::NAME => {
                let mut start = operation(spec.name, &spec.description, "201", spec.reply_schema);
                start["requestBody"] = json_body(spec.input_schema);
                paths.insert("/v1/episodes".into(), json!({ "post": start }));
            }
            _ => {
                let path = format!("/v1/episodes/{{episode_id}}/tools/{}", spec.name);
                paths.insert(path, json!({ "parameters": [episode_id()], "post": tool(spec) }));
            }
        }
    }
    let status = plain_schema::<<GetStatus as Tool>::Reply>();
    let result = plain_schema::<<Finish as Tool>::Reply>();
    paths.insert(
        "/v1/episodes/{episode_id}".into(),
        json!({
            "parameters": [episode_id()],
            "get": operation("episode_status", "Where the episode stands.", "200", status),
            "delete": operation("delete_episode", "End the episode, close its recording and forget it.", "200", result),
        }),
    );
    json!({
        "openapi": "3.1.0",
        "info": { "title": "Tandem", "version": version },
        "paths": paths,
        "components": { "schemas": { "Problem": plain_schema::<ProblemBody>() } },
    })
}

/// A call on an episode: the path names the episode, so the body need not.
fn tool(spec: ToolSpec) -> Value {
    let mut schema = spec.input_schema;
    if let Some(required) = schema["required"].as_array_mut() {
        required.retain(|name| name != "episode_id");
    }
    if let Some(properties) = schema["properties"].as_object_mut() {
        properties.shift_remove("episode_id");
    }
    let mut call = operation(spec.name, &spec.description, "200", spec.reply_schema);
    call["requestBody"] = json_body(schema);
    call
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

fn json_body(schema: Value) -> Value {
    json!({ "required": true, "content": { "application/json": { "schema": schema } } })
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
