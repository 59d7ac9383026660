//! `/docs`: the OpenAPI description as a page without scripts.

use std::fmt::Write;

use serde_json::{Map, Value};
use tandem_episodes::html::{self, escape};

/// Renders the page of an OpenAPI document.
pub fn page(document: &Value) -> String {
    let info = |name: &str| document["info"][name].as_str().unwrap_or_default();
    let title = format!("{} {}", info("title"), info("version"));
    let mut operations = String::new();
    for (path, methods) in entries(&document["paths"]) {
        for (method, operation) in entries(methods).filter(|(name, _)| *name != "parameters") {
            operations += &section(path, &method.to_uppercase(), operation, &methods["parameters"]);
        }
    }
    let body = format!(
        r#"<h1>{}</h1>
<p>The interface, as <a href="/v1/openapi.json">/v1/openapi.json</a> has it for programs. The same tools are served to MCP hosts
at <code>/mcp</code>, and as specifications for language models at <a href="/v1/tools">/v1/tools</a>.
<a href="/">The episodes</a> are on a page of their own.</p>
{operations}"#,
        escape(&title)
    );
    html::page(&title, &body)
}

/// Lists every operation of an OpenAPI document in a line, with the first sentence of its description.
pub fn brief(document: &Value) -> String {
    let mut lines = String::from(
        "What bodies and replies hold: GET /v1/openapi.json. Arguments of tools: GET /v1/tools.\n",
    );
    for (path, methods) in entries(&document["paths"]) {
        for (method, operation) in entries(methods).filter(|(name, _)| *name != "parameters") {
            let description = operation["description"].as_str().unwrap_or_default().replace('\n', " ");
            let sentence = description.split(". ").next().unwrap_or_default().trim_end_matches('.');
            let _ = writeln!(lines, "{} {path}: {sentence}.", method.to_uppercase());
        }
    }
    lines
}

/// Renders the section of one operation, which is folded at first.
fn section(path: &str, method: &str, operation: &Value, shared: &Value) -> String {
    let id = text(&operation["operationId"]);
    let mut body = format!("<p>{}</p>\n", text(&operation["description"]));
    let parameters = [shared, &operation["parameters"]].into_iter().filter_map(Value::as_array).flatten();
    let rows: String = parameters.map(parameter).collect();
    if !rows.is_empty() {
        body += &format!("<h3>In the address</h3>\n<table class=\"words\">\n{rows}</table>\n");
    }
    if let Some(schema) = schema(&operation["requestBody"]) {
        body += &format!("<h3>Body</h3>\n{}", fields(schema));
    }
    for (status, response) in entries(&operation["responses"]).filter(|(status, _)| *status != "default") {
        let answer = schema(response).map(fields).unwrap_or_default();
        let _ = write!(body, "<h3>{}: {}</h3>\n{answer}", escape(status), text(&response["description"]));
    }
    format!(
        "<details id=\"{id}\">\n<summary><b>{method}</b> <code>{}</code> <span class=\"soft\">{id}</span></summary>\n{body}</details>\n",
        escape(path)
    )
}

fn parameter(parameter: &Value) -> String {
    row(&text(&parameter["name"]), &parameter["schema"], parameter, parameter["required"] == true)
}

/// Renders the fields of an object as a table. The fields of a nested object follow the field that contains
/// it.
fn fields(schema: &Value) -> String {
    let schema = described(schema);
    let mut rows = String::new();
    list_fields(schema, "", &mut rows);
    match rows.is_empty() {
        true => format!("<p>{} {}</p>\n", kind(schema), text(&schema["description"])),
        false => format!("<table class=\"words\">\n{rows}</table>\n"),
    }
}

fn list_fields(schema: &Value, place: &str, rows: &mut String) {
    let required: Vec<&Value> = schema["required"].as_array().into_iter().flatten().collect();
    for (name, field) in entries(&schema["properties"]) {
        let place = format!("{place}{}", escape(name));
        *rows += &row(&place, field, field, required.iter().any(|required| **required == *name));
        let inner = described(field);
        match &inner["items"] {
            Value::Null => list_fields(inner, &format!("{place}."), rows),
            items => list_fields(described(items), &format!("{place}[]."), rows),
        }
    }
}

fn row(name: &str, schema: &Value, described: &Value, required: bool) -> String {
    let name = if required { format!("<b>{name}</b>") } else { name.to_owned() };
    format!(
        "<tr><td><code>{name}</code></td><td>{}</td><td class=\"long\">{}</td></tr>\n",
        kind(schema),
        text(&described["description"])
    )
}

/// Returns the schema of a field. For a nullable field, this is the schema of its other values.
fn described(schema: &Value) -> &Value {
    let choices = schema["anyOf"].as_array().filter(|_| schema.get("type").is_none());
    choices.into_iter().flatten().find(|choice| choice["type"] != "null").unwrap_or(schema)
}

/// Returns the type of a schema in words.
fn kind(schema: &Value) -> String {
    let schema = described(schema);
    let name = |kind: &Value| match (kind.as_str(), &schema["items"]) {
        (Some("array"), items @ Value::Object(_)) => format!("array of {}", self::kind(items)),
        (Some(kind), _) => escape(kind),
        (None, _) => String::new(),
    };
    let names = match &schema["type"] {
        Value::Array(kinds) => kinds.iter().map(name).collect::<Vec<_>>().join(" or "),
        kind => name(kind),
    };
    let listed = schema["enum"].as_array().into_iter().flatten();
    let named = schema["oneOf"].as_array().into_iter().flatten().map(|choice| &choice["const"]);
    let values: Vec<String> = listed.chain(named).filter_map(Value::as_str).map(escape).collect();
    if values.is_empty() { names } else { values.join(", ") }
}

fn schema(holder: &Value) -> Option<&Value> {
    holder["content"].as_object()?.values().next().map(|content| &content["schema"])
}

fn entries(object: &Value) -> impl Iterator<Item = (&str, &Value)> {
    object.as_object().into_iter().flat_map(Map::iter).map(|(name, value)| (name.as_str(), value))
}

fn text(value: &Value) -> String {
    escape(value.as_str().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use tandem_tools_spec::{Hints, tool_specs};

    use super::*;

    #[test]
    fn every_operation_is_there_with_its_fields() {
        let page = page(&tandem_tools_spec::openapi("1.2.3", Hints::On, false));
        for spec in tool_specs(Hints::On) {
            assert!(page.contains(&format!("<details id=\"{}\">", spec.name)), "{}", spec.name);
            for name in spec.input_schema["properties"].as_object().into_iter().flat_map(Map::keys) {
                assert!(page.contains(name.as_str()), "{} {name}", spec.name);
            }
        }
        let brief = brief(&tandem_tools_spec::openapi("1.2.3", Hints::On, false));
        let wait = brief
            .lines()
            .find(|line| line.starts_with("POST /v1/episodes/{episode_id}/tools/wait: "))
            .unwrap();
        assert!(wait.contains("Let all robots hold") && wait.len() < 300 && !brief.contains('<'), "{wait}");
        assert!(page.contains("<code><b>robots[].robot</b></code></td><td>string</td>"));
        assert!(page.contains("<td>array of number or null</td>"));
        assert!(page.contains("<td>agentic, benchmark</td>"));
    }

    #[test]
    fn nothing_is_loaded_and_nothing_breaks_out() {
        let mut document = tandem_tools_spec::openapi("1.2.3", Hints::On, false);
        document["info"]["title"] = "<script>".into();
        let page = page(&document);
        for foreign in ["<script", "src=", "url(", "@import", "http://", "https://", "<link"] {
            assert!(!page.contains(foreign), "{foreign}");
        }
    }
}
