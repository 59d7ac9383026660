//! `/` for programs: the first requests, as text. Browsers get `pages/home.rs`.

/// Returns the text for a server of this `version`.
pub fn brief(version: &str) -> String {
    format!(
        "Tandem {version}: simulated humanoids that must work together.\n\
         GET  /v1/tasks?short=true             the tasks\n\
         POST /v1/episodes                     begins one: {{\"task\": \"handover\", \"seed\": 2000}}; the reply says what there is to know\n\
         GET  /v1/tools                        the tools, as JSON Schema; ?format=openai, anthropic or mcp for their SDKs\n\
         POST /v1/episodes/{{id}}/tools/{{tool}}   calls one; \"short\": true leaves out of the reply what is as it should be\n\
         GET  /docs                            every route in a line; GET /v1/openapi.json all of it as OpenAPI\n\
         GET  /v1/episodes                     the episodes that are held\n\
         POST /mcp                             the same for MCP hosts\n"
    )
}
