//! The MCP route: the same tools for hosts that use the Model Context Protocol. Every call names its
//! episode, so the route keeps no sessions.

mod envelope;
mod prompt;
mod resources;

use std::sync::Arc;

use axum::{
    Router, body, extract,
    http::{HeaderValue, Method, header, request::Parts},
    middleware::{self, Next},
    response::{IntoResponse, Response},
};
use rmcp::{
    ErrorData, RoleServer, ServerHandler,
    model::{
        CallToolRequestParams, CallToolResponse, CallToolResult, ContentBlock, DiscoverResult,
        GetPromptRequestParams, GetPromptResponse, Implementation, InitializeRequestParams, InitializeResult,
        ListPromptsResult, ListResourcesResult, ListToolsResult, PaginatedRequestParams,
        ReadResourceRequestParams, ReadResourceResponse, ServerCapabilities, ServerConfig, Tool,
    },
    service::RequestContext,
    transport::streamable_http_server::{
        StreamableHttpServerConfig, StreamableHttpService, session::never::NeverSessionManager,
    },
};
use serde::Serialize;
use serde_json::Value;
use tandem_tools_spec::{
    Call, DepthImage, Format, ListTasks, LookReply, Observation, Observe, StartEpisode, TalkCall, Tool as _,
    ToolReply, ToolSpec, parse_args, parse_start,
};

use super::{
    app::{AppState, counted, every_tool},
    body::check_unique_fields,
    problem::ApiError,
};
use crate::hosting::{Answer, Caller, HostingError, RefusedCall};

/// Accept header that the library requires; the answers are JSON.
const ACCEPTED: &str = "application/json, text/event-stream";

/// Returns the instructions about the server that a host passes to its model, limited to the calls that
/// `caller` may make.
fn instructions(caller: &Caller) -> String {
    let begin = match caller {
        Caller::Host => "Call start_episode, whose tasks list_tasks names, then look".into(),
        // An operator's episode is already under way, and it cannot start another.
        Caller::Operator { episode, robot } => {
            format!("You are the operator of robot {robot} in the episode {episode}, which has begun. Look")
        }
    };
    let whole = match caller {
        Caller::Host => " The tools and start_episode tell all that a player needs.",
        Caller::Operator { .. } => "",
    };
    format!(
        "Simulated humanoids that must work together. {begin} with observe and act with move_wrists, walk, \
         send_joint_chunk or wait until the task is done, then call finish. Physics stands still between calls. \
         Replies are short; `short: false` gives the whole one.{whole}"
    )
}

/// Returns the routes to nest at `/mcp`, behind the gate, which has checked `Host` and `Origin`.
pub fn router(app: AppState) -> Router {
    Router::new().fallback_service(service(app)).layer(middleware::from_fn(check_body))
}

fn service(app: AppState) -> StreamableHttpService<McpServer, NeverSessionManager> {
    let config = StreamableHttpServerConfig::default()
        .with_legacy_session_mode(false)
        .with_json_response(true)
        .with_max_request_body_bytes(app.settings.max_body_bytes)
        .disable_allowed_hosts();
    StreamableHttpService::new(move || Ok(McpServer { app: app.clone() }), Arc::default(), config)
}

/// An MCP server that answers from the table of episodes.
#[derive(Debug, Clone)]
struct McpServer {
    app: AppState,
}

impl ServerHandler for McpServer {
    fn get_info(&self) -> ServerConfig {
        ServerConfig::new(
            ServerCapabilities::builder().enable_tools().enable_prompts().enable_resources().build(),
        )
        .with_server_info(Implementation::new("tandem", env!("CARGO_PKG_VERSION")))
        .with_instructions(instructions(&Caller::Host))
    }

    async fn initialize(
        &self,
        request: InitializeRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<InitializeResult, ErrorData> {
        context.peer.set_peer_info(request.clone());
        let server = self.negotiate_initialize(&request)?;
        Ok(server.with_instructions(self.instructions(caller_of(&context).unwrap_or(&Caller::Host)).await))
    }

    async fn discover(&self, context: RequestContext<RoleServer>) -> Result<DiscoverResult, ErrorData> {
        let caller = caller_of(&context).unwrap_or(&Caller::Host);
        let server = self.get_info().with_instructions(self.instructions(caller).await);
        Ok(DiscoverResult::from_server_info(self.supported_protocol_versions().into_owned(), server))
    }

    async fn list_tools(
        &self,
        _: Option<PaginatedRequestParams>,
        context: RequestContext<RoleServer>,
    ) -> Result<ListToolsResult, ErrorData> {
        let specs = self.app.tool_specs(caller_of(&context).unwrap_or(&Caller::Host));
        let listed = |spec: &ToolSpec| match wants_structure(&context) {
            true => spec.structured(),
            false => spec.formatted(Format::Mcp),
        };
        let tools: Result<Vec<Tool>, _> =
            specs.iter().map(|spec| serde_json::from_value(listed(spec))).collect();
        let tools = tools.map_err(|error| ErrorData::internal_error(error.to_string(), None))?;
        Ok(ListToolsResult::with_all_items(tools))
    }

    async fn list_prompts(
        &self,
        _: Option<PaginatedRequestParams>,
        _: RequestContext<RoleServer>,
    ) -> Result<ListPromptsResult, ErrorData> {
        Ok(ListPromptsResult::with_all_items(prompt::prompts(&self.app.settings.tasks)))
    }

    async fn get_prompt(
        &self,
        request: GetPromptRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<GetPromptResponse, ErrorData> {
        let arguments = request.arguments.unwrap_or_default();
        let caller = caller_of(&context).unwrap_or(&Caller::Host);
        Ok(prompt::prompt(&request.name, arguments, &self.app, caller)?.into())
    }

    async fn list_resources(
        &self,
        _: Option<PaginatedRequestParams>,
        context: RequestContext<RoleServer>,
    ) -> Result<ListResourcesResult, ErrorData> {
        let caller = caller_of(&context).unwrap_or(&Caller::Host);
        Ok(ListResourcesResult::with_all_items(resources::resources(&self.app, caller)))
    }

    async fn read_resource(
        &self,
        request: ReadResourceRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<ReadResourceResponse, ErrorData> {
        let caller = caller_of(&context).unwrap_or(&Caller::Host);
        Ok(resources::read(&self.app, caller, &request.uri).await?.into())
    }

    async fn call_tool(
        &self,
        request: CallToolRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<CallToolResponse, ErrorData> {
        if !every_tool().contains(&request.name.as_ref()) {
            let specs = self.app.tool_specs(caller_of(&context).unwrap_or(&Caller::Host));
            let have: Vec<&str> = specs.iter().map(|spec| spec.name).collect();
            let text = format!("no tool {:?}; have: {}", request.name, have.join(", "));
            return Err(ErrorData::invalid_params(text, None));
        }
        let args = Value::Object(request.arguments.unwrap_or_default());
        let episode = args["episode_id"].as_str().map(str::to_owned);
        let called = match duplicate_field(&context) {
            Some(DuplicateField(reason)) => Err(ApiError::MalformedJson(reason.clone())),
            None => match caller_of(&context) {
                Some(caller) => {
                    counted(&self.app, &request.name, self.call(caller, &request.name, args)).await
                }
                None => Err(ApiError::NoToken),
            },
        };
        self.log_call(&request.name, episode.as_deref(), called.as_ref().err());
        let result = match called {
            Ok(content) => {
                let structured = wants_structure(&context) && request.name != Observe::NAME;
                let value = structured.then(|| structure(&content)).flatten();
                let mut result = CallToolResult::success(content);
                result.structured_content = value;
                result
            }
            // A refusal is returned as the tool's answer, which the model reads. Hosts often do not show
            // protocol errors to the model.
            Err(error) => CallToolResult::error(refusal_blocks(&error)),
        };
        Ok(result.into())
    }
}

impl McpServer {
    /// Returns the instructions for `caller`. An operator's instructions contain its part of the task and
    /// advice on playing with partners, since a model may see no other part of the briefing.
    async fn instructions(&self, caller: &Caller) -> String {
        let begin = instructions(caller);
        let Caller::Operator { episode, .. } = caller else { return begin };
        let Ok(briefing) = self.app.table.briefing(episode, caller).await else { return begin };
        let own = briefing.instructions.into_iter().map(|entry| format!(" Your part: {}", entry.instruction));
        let teamwork = briefing.brief.teamwork.map(|text| format!(" {text}"));
        [begin].into_iter().chain(own).chain(teamwork).collect()
    }

    async fn call(&self, caller: &Caller, name: &str, args: Value) -> Result<Vec<ContentBlock>, ApiError> {
        match name {
            ListTasks::NAME => {
                let ListTasks { short } = parse_args(short_unless_given(args))?;
                let list = self.app.table.task_list();
                json_block(&if short { list.shortened() } else { list })
            }
            StartEpisode::NAME => {
                if let Caller::Operator { .. } = caller {
                    return Err(HostingError::HostsBusiness.into());
                }
                let (args, driving) = parse_start(short_unless_given(args))?;
                json_block(&self.app.table.start_driven(args, driving).await?)
            }
            _ => self.call_episode(caller, name, args).await,
        }
    }

    /// Logs a call and counts a refusal. The log line of the HTTP request has neither the tool nor the
    /// problem.
    fn log_call(&self, tool: &str, episode: Option<&str>, refusal: Option<&ApiError>) {
        // An unknown id may be arbitrary text of the caller, so it is not logged.
        let episode = episode.filter(|id| self.app.table.get(id).is_ok());
        let problem = refusal.map(ApiError::kind);
        if let Some(kind) = problem {
            self.app.table.metrics().request_refused(kind);
        }
        tracing::info!(tool, problem, episode, "call");
    }

    async fn call_episode(
        &self,
        caller: &Caller,
        name: &str,
        mut args: Value,
    ) -> Result<Vec<ContentBlock>, ApiError> {
        let handle = args.as_object_mut().and_then(|object| object.shift_remove("episode_id"));
        let asked = args.to_string();
        let named = handle.as_ref().and_then(Value::as_str).unwrap_or("as start_episode returned it");
        let call = Call::parse(name, short_unless_given(args))
            .map_err(|error| ApiError::from(error.naming_episode(named)));
        let id = match (handle, caller) {
            (Some(Value::String(id)), _) => id,
            // An operator's token implies its episode.
            (None, Caller::Operator { episode, .. }) => episode.clone(),
            (None, Caller::Host) if TalkCall::TOOLS.contains(&name) => {
                return Err(HostingError::NoTalk.into());
            }
            _ => {
                call?;
                return Err(ApiError::NoEpisodeNamed { tool: name.into() });
            }
        };
        let episode = self.app.table.awake(&id).await;
        let call = match &episode {
            Ok(episode) => {
                episode.admit(caller)?;
                let offered = episode.check_offered(caller, name).map_err(ApiError::from);
                match offered.and(call) {
                    Ok(call) => call,
                    Err(refusal) => {
                        let problem = refusal.to_string();
                        let refused = RefusedCall { tool: name.into(), arguments: asked, problem };
                        episode.refused(caller, refused).await;
                        return Err(refusal.in_episode(&episode.thread));
                    }
                }
            }
            Err(_) => call?,
        };
        let episode = episode?;
        let answered = episode.call(caller, call, None).await;
        content(&answered.map_err(|error| ApiError::from(error).in_episode(&episode.thread))?.reply)
    }
}

/// Requests a short reply, unless the call sets `short`, because a model reads the whole reply. The
/// instructions mention this default.
fn short_unless_given(mut args: Value) -> Value {
    if let Some(args) = args.as_object_mut() {
        args.entry("short").or_insert(true.into());
    }
    args
}

/// Returns the content of an answer: its JSON without images, then the images.
fn content(answer: &Answer) -> Result<Vec<ContentBlock>, ApiError> {
    let mut text = serde_json::to_value(answer).map_err(|error| ApiError::Reply(error.into()))?;
    let seen = match (&answer.reply, &answer.observation) {
        (ToolReply::Look(LookReply::Observe(seen)), _) => seen,
        (_, Some(seen)) => {
            remove_images(&mut text["observation"]);
            seen
        }
        _ => return json_block(&text),
    };
    remove_images(&mut text);
    let mut content = json_block(&text)?;
    if !(seen.images.is_empty() && seen.depth_images.is_empty()) {
        content.push(ContentBlock::text(image_captions(seen)));
    }
    let depths = seen.depth_images.iter().map(|image| &image.png_base64);
    let files = seen.images.iter().map(|image| &image.png_base64).chain(depths);
    content.extend(files.map(|file| ContentBlock::image(file.to_base64(), "image/png")));
    content.extend(seen.links.iter().map(|link| ContentBlock::resource_link(resources::image(link))));
    Ok(content)
}

fn remove_images(seen: &mut Value) {
    if let Value::Object(seen) = seen {
        seen.shift_remove("images");
        seen.shift_remove("depth_images");
    }
}

/// Returns true if the query of the client's URL requests output schemas and structured content. Structured
/// content repeats the reply, and a model would read both.
fn wants_structure(context: &RequestContext<RoleServer>) -> bool {
    let query = context.extensions.get::<Parts>().and_then(|parts| parts.uri.query());
    query.into_iter().flat_map(|query| query.split('&')).any(|pair| pair == "output=structured")
}

/// Returns the JSON of a reply without images.
fn structure(content: &[ContentBlock]) -> Option<Value> {
    serde_json::from_str(&content.first()?.as_text()?.text).ok()
}

/// Returns the caller that the gate has identified.
fn caller_of(context: &RequestContext<RoleServer>) -> Option<&Caller> {
    context.extensions.get::<Parts>()?.extensions.get()
}

/// Names the robot of each of the following images, and the range of depths.
fn image_captions(seen: &Observation) -> String {
    let depth = |DepthImage { robot, white_m, black_m, .. }: &DepthImage| {
        format!("depth of {robot}, grey linear in 1 / depth, white {white_m} m, black {black_m} m or nothing")
    };
    let names = seen.images.iter().map(|image| image.robot.clone());
    let names: Vec<String> = names.chain(seen.depth_images.iter().map(depth)).collect();
    let of = |(index, name): (usize, &String)| format!(" Image {}: {name}.", index + 1);
    format!("{} images follow.{}", names.len(), names.iter().enumerate().map(of).collect::<String>())
}

/// Returns a refusal as text for a model.
fn refusal_blocks(error: &ApiError) -> Vec<ContentBlock> {
    let failed = error.recording_failed().map(|reason| format!("recording_failed: {reason}"));
    let result = error.result().and_then(|result| serde_json::to_string(result).ok());
    let result = result.map(|result| format!("result: {result}"));
    [error.body().detail].into_iter().chain(failed).chain(result).map(ContentBlock::text).collect()
}

/// A duplicate field in a body. The JSON-RPC library would keep the last of the two.
#[derive(Clone)]
struct DuplicateField(String);

/// Refuses invalid messages. A duplicate field is recorded on the request, for the answer to its call.
async fn check_body(request: extract::Request, next: Next) -> Response {
    let (mut parts, body) = request.into_parts();
    accept_whatever_fits(&mut parts);
    // The gate has already received the body, within its limit.
    let bytes = body::to_bytes(body, usize::MAX).await.unwrap_or_default();
    if parts.method == Method::POST
        && let Err(error) = envelope::check(&bytes)
    {
        return error.into_response();
    }
    if let Err(reason) = check_unique_fields(&bytes) {
        parts.extensions.insert(DuplicateField(reason));
    }
    next.run(extract::Request::from_parts(parts, bytes.into())).await
}

/// Sets the Accept header that the library requires, for a client that accepts any type or sends no such
/// header.
fn accept_whatever_fits(parts: &mut Parts) {
    let accepted = parts.headers.get_all(header::ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let ranges: Vec<&str> = accepted.flat_map(|value| value.split(',')).collect();
    let media = |range: &str| range.split(';').next().unwrap_or_default().trim().to_ascii_lowercase();
    let any = |range: &&str| matches!(&*media(range), "*/*" | "application/*" | "application/json");
    if ranges.is_empty() || ranges.iter().any(any) {
        parts.headers.insert(header::ACCEPT, HeaderValue::from_static(ACCEPTED));
    }
}

fn duplicate_field(context: &RequestContext<RoleServer>) -> Option<&DuplicateField> {
    context.extensions.get::<Parts>()?.extensions.get()
}

fn json_block(reply: &impl Serialize) -> Result<Vec<ContentBlock>, ApiError> {
    let text = serde_json::to_string(reply).map_err(|error| ApiError::Reply(error.into()))?;
    Ok(vec![ContentBlock::text(text)])
}
