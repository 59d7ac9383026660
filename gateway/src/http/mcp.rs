//! The MCP route: the same tools for hosts that speak the Model Context Protocol. Every call names its episode, so the
//! route keeps no sessions.

use std::sync::Arc;

use axum::{
    Router, body, extract,
    http::request::Parts,
    middleware::{self, Next},
    response::Response,
};
use rmcp::{
    ErrorData, RoleServer, ServerHandler,
    model::{
        CallToolRequestParams, CallToolResponse, CallToolResult, ContentBlock, Implementation,
        ListToolsResult, PaginatedRequestParams, ServerCapabilities, ServerConfig, Tool, ToolAnnotations,
    },
    service::RequestContext,
    transport::streamable_http_server::{
        StreamableHttpServerConfig, StreamableHttpService, session::never::NeverSessionManager,
    },
};
use serde::Serialize;
use serde_json::Value;
use tandem_tools_spec::{
    Hints, ListTasks, LookReply, SpecError, StartEpisode, Tool as _, ToolReply, ToolSpec, parse_args,
    parse_start, say_tool, tool_specs,
};

use super::{app::App, problem::ApiError, request::unambiguous};
use crate::hosting::{Answer, Caller, HostingError, Request};

/// What a host tells its model about the server as a whole.
const INSTRUCTIONS: &str = "Simulated humanoids that must work together. Call list_tasks, then start_episode, then look \
    with observe and act with move_wrists, walk, send_joint_chunk or wait until the task is done, then call finish. \
    Physics stands still between calls.";

/// What is nested at `/mcp`, behind the gate, which has looked at `Host` and `Origin`.
pub fn router(app: App) -> Router {
    Router::new().fallback_service(service(app)).layer(middleware::from_fn(note_ambiguity))
}

fn service(app: App) -> StreamableHttpService<McpServer, NeverSessionManager> {
    let config = StreamableHttpServerConfig::default()
        .with_legacy_session_mode(false)
        .with_json_response(true)
        .with_max_request_body_bytes(app.settings.max_body_bytes)
        .disable_allowed_hosts();
    StreamableHttpService::new(move || Ok(McpServer { app: app.clone() }), Arc::default(), config)
}

/// Answers MCP requests from the table of episodes.
#[derive(Debug, Clone)]
struct McpServer {
    app: App,
}

impl ServerHandler for McpServer {
    fn get_info(&self) -> ServerConfig {
        ServerConfig::new(ServerCapabilities::builder().enable_tools().build())
            .with_server_info(Implementation::new("tandem", env!("CARGO_PKG_VERSION")))
            .with_instructions(INSTRUCTIONS)
    }

    async fn list_tools(
        &self,
        _: Option<PaginatedRequestParams>,
        context: RequestContext<RoleServer>,
    ) -> Result<ListToolsResult, ErrorData> {
        let hints = self.app.settings.hints;
        let mut specs = tool_specs(hints);
        if caller(&context).is_some_and(|who| self.app.table.may_talk(&who)) {
            specs.push(say_tool(hints));
        }
        Ok(ListToolsResult::with_all_items(specs.iter().map(described).collect()))
    }

    async fn call_tool(
        &self,
        request: CallToolRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<CallToolResponse, ErrorData> {
        let args = Value::Object(request.arguments.unwrap_or_default());
        let called = match ambiguity(&context) {
            Some(Ambiguous(reason)) => Err(ApiError::MalformedJson(reason.clone())),
            None => match caller(&context) {
                Some(who) => self.call(&who, &request.name, args).await,
                None => Err(ApiError::NoToken),
            },
        };
        let result = match called {
            Ok(content) => CallToolResult::success(content),
            // A refusal is the tool's answer, which the model is to read; protocol errors often stay with the host.
            Err(error) => CallToolResult::error(refused(&error)),
        };
        Ok(result.into())
    }
}

impl McpServer {
    async fn call(&self, who: &Caller, name: &str, args: Value) -> Result<Vec<ContentBlock>, ApiError> {
        match name {
            ListTasks::NAME => {
                parse_args::<ListTasks>(args)?;
                json_block(&self.app.table.task_list())
            }
            StartEpisode::NAME => {
                if let Caller::Operator { .. } = who {
                    return Err(HostingError::HostsBusiness.into());
                }
                let (args, driving) = parse_start(args)?;
                json_block(&self.app.table.start_driven(args, driving).await?)
            }
            _ => self.call_episode(who, name, args).await,
        }
    }

    async fn call_episode(
        &self,
        who: &Caller,
        name: &str,
        mut args: Value,
    ) -> Result<Vec<ContentBlock>, ApiError> {
        let handle = args.as_object_mut().and_then(|object| object.shift_remove("episode_id"));
        let request = Request::parse(name, args).map_err(|error| ApiError::from(with_every_tool(error)));
        let id = match (handle, who) {
            (Some(Value::String(id)), _) => id,
            // An operator's token says which.
            (None, Caller::Operator { episode, .. }) => episode.clone(),
            _ => {
                request?;
                return Err(ApiError::NoEpisodeNamed { tool: name.into() });
            }
        };
        let episode = self.app.table.hosted(&id);
        let request = match &episode {
            Ok(episode) => request.map_err(|refusal| refusal.of(&episode.thread))?,
            Err(_) => request?,
        };
        let episode = episode?;
        let answered = episode.call(who, request, None).await;
        content(&answered.map_err(|error| ApiError::from(error).of(&episode.thread))?.reply)
    }
}

/// An answer as blocks: its text without pictures, then the pictures.
fn content(answer: &Answer) -> Result<Vec<ContentBlock>, ApiError> {
    let mut text = serde_json::to_value(answer).map_err(|error| ApiError::Reply(error.into()))?;
    let seen = match (&answer.reply, &answer.observation) {
        (ToolReply::Look(LookReply::Observe(seen)), _) => seen,
        (_, Some(seen)) => {
            if let Value::Object(observation) = &mut text["observation"] {
                observation.shift_remove("images");
            }
            seen
        }
        _ => return json_block(&text),
    };
    if let Value::Object(object) = &mut text {
        object.shift_remove("images");
    }
    let mut content = json_block(&text)?;
    let robots: Vec<&str> = seen.images.iter().map(|image| image.robot.as_str()).collect();
    content.push(ContentBlock::text(format!("{} images follow: {}", robots.len(), robots.join(", "))));
    content.extend(
        seen.images.iter().map(|image| ContentBlock::image(image.png_base64.to_base64(), "image/png")),
    );
    Ok(content)
}

/// Who calls, as the gate has found out.
fn caller(context: &RequestContext<RoleServer>) -> Option<Caller> {
    context.extensions.get::<Parts>()?.extensions.get().cloned()
}

/// This route serves the tools that need no episode, too.
fn with_every_tool(error: SpecError) -> SpecError {
    match error {
        SpecError::UnknownTool { name, .. } => SpecError::UnknownTool { name, have: every_tool() },
        error => error,
    }
}

fn every_tool() -> Vec<&'static str> {
    tool_specs(Hints::default()).iter().map(|spec| spec.name).collect()
}

/// A refusal as a model reads it.
fn refused(error: &ApiError) -> Vec<ContentBlock> {
    let failed = error.recording_failed().map(|reason| format!("recording_failed: {reason}"));
    [error.body().detail].into_iter().chain(failed).map(ContentBlock::text).collect()
}

/// Why a request can be read in two ways. What reads JSON-RPC behind this keeps the last of two fields of one name.
#[derive(Clone)]
struct Ambiguous(String);

/// Notes on a request whether its body names a field twice, for when its call is answered.
async fn note_ambiguity(request: extract::Request, next: Next) -> Response {
    let (mut parts, body) = request.into_parts();
    // The gate has received it, within its limit.
    let bytes = body::to_bytes(body, usize::MAX).await.unwrap_or_default();
    if let Err(reason) = unambiguous(&bytes) {
        parts.extensions.insert(Ambiguous(reason));
    }
    next.run(extract::Request::from_parts(parts, bytes.into())).await
}

fn ambiguity(context: &RequestContext<RoleServer>) -> Option<&Ambiguous> {
    context.extensions.get::<Parts>()?.extensions.get()
}

fn json_block(reply: &impl Serialize) -> Result<Vec<ContentBlock>, ApiError> {
    let text = serde_json::to_string(reply).map_err(|error| ApiError::Reply(error.into()))?;
    Ok(vec![ContentBlock::text(text)])
}

/// The tool as MCP describes it. No output schema: clients drop the pictures of tools that declare one.
fn described(spec: &ToolSpec) -> Tool {
    Tool::new(spec.name, spec.description.clone(), Arc::new(spec.lenient_schema())).with_annotations(
        ToolAnnotations::new().read_only(spec.read_only).destructive(false).open_world(false),
    )
}
