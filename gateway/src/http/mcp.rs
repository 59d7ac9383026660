//! The MCP route: the same tools for hosts that speak the Model Context Protocol. Every call names its episode, so the
//! route keeps no sessions.

use std::sync::Arc;

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
    ListTasks, LookReply, SpecError, StartEpisode, Tool as _, ToolCall, ToolReply, ToolSpec, parse_args,
    tool_specs,
};

use super::{app::App, problem::ApiError};

/// What a host tells its model about the server as a whole.
const INSTRUCTIONS: &str = "Simulated humanoids that must work together. Call list_tasks, then start_episode, then look \
    with observe and act with move_wrists, walk, send_joint_chunk or wait until the task is done, then call finish. \
    Physics stands still between calls.";

/// The service that is nested at `/mcp`, behind the gate, which has looked at `Host` and `Origin`.
pub fn service(app: App) -> StreamableHttpService<McpServer, NeverSessionManager> {
    let config = StreamableHttpServerConfig::default()
        .with_legacy_session_mode(false)
        .with_json_response(true)
        .with_max_request_body_bytes(app.settings.max_body_bytes)
        .disable_allowed_hosts();
    StreamableHttpService::new(move || Ok(McpServer { app: app.clone() }), Arc::default(), config)
}

/// Answers MCP requests from the table of episodes.
#[derive(Debug, Clone)]
pub struct McpServer {
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
        _: RequestContext<RoleServer>,
    ) -> Result<ListToolsResult, ErrorData> {
        Ok(ListToolsResult::with_all_items(tool_specs().into_iter().map(described).collect()))
    }

    async fn call_tool(
        &self,
        request: CallToolRequestParams,
        _: RequestContext<RoleServer>,
    ) -> Result<CallToolResponse, ErrorData> {
        let args = Value::Object(request.arguments.unwrap_or_default());
        let result = match self.call(&request.name, args).await {
            Ok(content) => CallToolResult::success(content),
            // A refusal is the tool's answer, which the model is to read; protocol errors often stay with the host.
            Err(error) => CallToolResult::error(vec![ContentBlock::text(error.body().detail)]),
        };
        Ok(result.into())
    }
}

impl McpServer {
    async fn call(&self, name: &str, args: Value) -> Result<Vec<ContentBlock>, ApiError> {
        match name {
            ListTasks::NAME => {
                parse_args::<ListTasks>(args)?;
                json_block(&self.app.table.task_list())
            }
            StartEpisode::NAME => json_block(&self.app.table.start(parse_args(args)?).await?),
            _ => self.call_episode(name, args).await,
        }
    }

    async fn call_episode(&self, name: &str, mut args: Value) -> Result<Vec<ContentBlock>, ApiError> {
        let handle = args.as_object_mut().and_then(|object| object.shift_remove("episode_id"));
        let call = ToolCall::parse(name, args).map_err(with_every_tool)?;
        let Some(Value::String(id)) = handle else {
            return Err(ApiError::NoEpisodeNamed { tool: call.name() });
        };
        let mut answer = self.app.table.get(&id)?.call(call).await?;
        match &mut answer.reply {
            ToolReply::Look(LookReply::Observe(observation)) => {
                let images = std::mem::take(&mut observation.images);
                let mut content = json_block(&answer)?;
                let robots: Vec<&str> = images.iter().map(|image| image.robot.as_str()).collect();
                content.push(ContentBlock::text(format!(
                    "{} images follow: {}",
                    robots.len(),
                    robots.join(", ")
                )));
                content.extend(
                    images.iter().map(|image| ContentBlock::image(image.png_base64.to_base64(), "image/png")),
                );
                Ok(content)
            }
            _ => json_block(&answer),
        }
    }
}

/// This route serves the tools that need no episode, too.
fn with_every_tool(error: SpecError) -> SpecError {
    match error {
        SpecError::UnknownTool { name, .. } => {
            SpecError::UnknownTool { name, have: tool_specs().iter().map(|spec| spec.name).collect() }
        }
        error => error,
    }
}

fn json_block(reply: &impl Serialize) -> Result<Vec<ContentBlock>, ApiError> {
    let text = serde_json::to_string(reply).map_err(ApiError::Reply)?;
    Ok(vec![ContentBlock::text(text)])
}

/// The tool as MCP describes it. No output schema: clients drop the pictures of tools that declare one.
fn described(spec: ToolSpec) -> Tool {
    Tool::new(spec.name, spec.description, Arc::new(spec.input_schema)).with_annotations(
        ToolAnnotations::new().read_only(spec.read_only).destructive(false).open_world(false),
    )
}
