//! The prompt that MCP hosts offer their users: the information that a policy needs about a task before
//! it begins.

use rmcp::{
    ErrorData,
    model::{GetPromptResult, JsonObject, Prompt, PromptArgument, PromptMessage, Role},
};
use tandem_episodes::{brief, tasks::TaskSet};
use tandem_tools_spec::{Brief, Protocol, ProtocolInfo, StartEpisode, TaskInfo, parse_args};

use crate::{hosting::Caller, http::app::AppState};

/// Name of the only prompt.
const NAME: &str = "play_task";

/// Returns the prompts that hosts may offer.
pub fn prompts(tasks: &TaskSet) -> Vec<Prompt> {
    let argument = |name: &str, text: &str, required: bool| {
        PromptArgument::new(name).with_description(text).with_required(required)
    };
    let ids: Vec<&str> = tasks.all().map(|task| task.id.as_str()).collect();
    let arguments = vec![
        argument("task", &format!("What to play: {}.", ids.join(", ")), true),
        argument("seed", "Decides where the objects stand; 0 if it is not given.", false),
        argument("protocol", "agentic or benchmark; agentic if it is not given.", false),
    ];
    let prompt =
        Prompt::new(NAME, Some("Play a task: what has to be done, and what to know."), Some(arguments));
    vec![prompt.with_title("Play a task")]
}

/// Returns the prompt called `name` for `caller`, with the task, seed and protocol in `arguments`. The tasks
/// are in `list`.
pub fn prompt(
    name: &str,
    arguments: JsonObject,
    app: &AppState,
    caller: &Caller,
) -> Result<GetPromptResult, ErrorData> {
    let refused = |text: String| ErrorData::invalid_params(text, None);
    let (list, tasks) = (app.table.task_list(), &app.settings.tasks);
    if name != NAME {
        return Err(refused(format!("no prompt {name:?}; have: {NAME}")));
    }
    let start = start(arguments).map_err(refused)?;
    let info = list.tasks.iter().find(|info| info.id == start.task);
    let info = info.ok_or_else(|| {
        let have: Vec<&str> = list.tasks.iter().map(|info| info.id.as_str()).collect();
        refused(format!("no task {:?}; have: {}", start.task, have.join(", ")))
    })?;
    let grips = tasks.find(&start.task).ok().and_then(|task| task.grips.as_deref());
    let brief = brief(app.settings.wording(), &list.base_limits, app.settings.camera, grips);
    let text = text(info, &start, &brief, caller);
    let mut result = GetPromptResult::new(vec![PromptMessage::new_text(Role::User, text)]);
    result.description = Some(info.instruction.clone());
    Ok(result)
}

/// Parses the arguments of a prompt, which are all strings. The seed becomes a number.
fn start(mut arguments: JsonObject) -> Result<StartEpisode, String> {
    let seed = match arguments.remove("seed") {
        None => 0,
        Some(seed) => {
            let text = seed.as_str().map_or_else(|| seed.to_string(), str::to_owned);
            text.trim().parse::<u32>().map_err(|error| format!("seed {text:?}: {error}; give one as 0"))?
        }
    };
    arguments.insert("seed".into(), seed.into());
    parse_args(arguments.into()).map_err(|error| error.to_string())
}

fn text(task: &TaskInfo, start: &StartEpisode, brief: &Brief, caller: &Caller) -> String {
    let protocol = start.protocol.unwrap_or(Protocol::Agentic);
    let robots = task.robots.iter().map(|robot| format!("* {}: {}", robot.robot, robot.instruction));
    let phases =
        task.phases.iter().map(|phase| format!("* {} {}: {}", phase.number, phase.id, phase.description));
    let phases = phases.collect::<Vec<_>>().join("\n");
    let phases = (!phases.is_empty()).then(|| format!("The phases that are scored:\n{phases}"));
    let budget = task.protocols.iter().find(|info| info.protocol == protocol).map(budget);
    let brief = brief.lines();
    let lines = |lines: &mut dyn Iterator<Item = String>| lines.collect::<Vec<_>>().join("\n");
    let begin = match caller {
        Caller::Host => {
            format!("Begin with start_episode, task {}, seed {}, protocol {protocol}. ", task.id, start.seed)
        }
        // The episode is already under way.
        Caller::Operator { robot, .. } => format!("You are the operator of robot {robot}. "),
    };
    let paragraphs = [
        Some(task.instruction.clone()),
        Some(format!("The robots:\n{}", lines(&mut robots.into_iter()))),
        phases,
        budget,
        Some(brief.join("\n")),
        Some(format!(
            "{begin}Look with observe, measure with query_depth, act \
             with move_wrists, walk and wait, and check with every reply what came of it. Call finish when the task is done."
        )),
    ];
    paragraphs.into_iter().flatten().collect::<Vec<_>>().join("\n\n")
}

fn budget(info: &ProtocolInfo) -> String {
    let thinking = match info.wall_clock_s {
        Some(wall_clock_s) => format!(", and {wall_clock_s} s for your own thinking"),
        None => String::new(),
    };
    format!(
        "You have {} control steps of 20 ms, {} of them held still at the start, at most {} per command{thinking}.",
        info.episode_steps, info.initial_hold_steps, info.steps_per_command
    )
}
