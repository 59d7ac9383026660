//! `tandem agent`: a language model plays episodes on a server in this process; its messages and calls
//! are printed.

use std::{
    fs, io,
    net::Ipv4Addr,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
    thread,
};

use serde::Deserialize;
use serde_json::{Map, Value};
use tandem_episodes::{shell_word, tasks};
use tandem_tools_spec::Assistance;
use tracing_subscriber::filter::LevelFilter;

use super::{
    CommandResult, Seeds, demo,
    flags::{AgentFlags, GivenFlags, RobotModels, WorldFlags},
    logging::log_to_stderr,
};
use crate::{
    drivers::{PythonModule, PythonPart},
    hosting::try_runs_folder,
    http::{Server, shutdown_signal},
    settings::{Layer, Settings, one_of},
    token::Token,
};

/// Port number that makes the system pick a free port.
const FREE_PORT: u16 = 0;

/// Default time limit of a model for an episode.
const LIMIT_S: u32 = 3600;

/// Placeholder for no child process; no process has this id.
const NO_CHILD: u32 = 0;

/// Exit status that shells report for a process that SIGINT has ended.
const INTERRUPTED: i32 = 130;

/// File in an episode's folder to which Python writes the flags of the run.
const AGENT_FILE: &str = "agent.json";

/// Let a language model play a task through any endpoint with OpenAI's or Anthropic's formats. This needs the
/// Python package: pip install 'tandem-sim[agents]' (in a checkout './gateway/python[agents]'). API keys are
/// read from the environment: OPENAI_API_KEY, ANTHROPIC_API_KEY.
#[allow(
    rustdoc::broken_intra_doc_links,
    reason = "the command line's help names an extra of the wheel, and no link"
)]
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("player").required(true).multiple(true).args(["model", "resume"]))]
pub struct AgentArgs {
    #[command(flatten)]
    given: GivenFlags,
    #[command(flatten)]
    agent: AgentFlags,
    /// Id of the task [default: that of --task-file, or else handover].
    #[arg(long, value_name = "TASK")]
    task: Option<String>,
    /// One seed, or a range of seeds as 0-9 or 0..9, both ends included.
    #[arg(long, alias = "seed", default_value = "0", value_name = "SEEDS")]
    seeds: Seeds,
    /// Information for the model, as in `serve`.
    #[arg(long, env = "TANDEM_ASSISTANCE", value_name = "WHAT", value_parser = one_of(Assistance::ALL, Assistance::name),
          default_value = Assistance::Full.name())]
    assistance: Assistance,
    /// Use one model per robot, which sees and commands only that robot.
    #[arg(long)]
    per_robot: bool,
    /// With --per-robot: let the models talk to each other with the tool `say`.
    #[arg(long, requires = "per_robot")]
    talk: bool,
    #[command(flatten)]
    robot_models: RobotModels,
    /// Folder for recordings, one folder per episode.
    #[arg(long, env = "TANDEM_RUNS", default_value = "runs", value_name = "DIR")]
    runs: PathBuf,
    /// Resume the episode in this folder, for example runs/handover-seed0, after its agent was killed. Only
    /// limits, prices and --base-url can be changed.
    #[arg(long, value_name = "FOLDER")]
    resume: Option<PathBuf>,
    #[command(flatten)]
    world: WorldFlags,
}

/// Part of [`AGENT_FILE`] that this program reads.
#[derive(Debug, Deserialize)]
struct AgentFile {
    flags: ServerFlags,
}

/// Flags of an episode that concern its server.
#[derive(Debug, Deserialize)]
struct ServerFlags {
    assistance: Assistance,
}

/// Plays every seed, or resumes an episode. The program fails if the model's endpoint gives no answer.
pub fn run(args: AgentArgs) -> CommandResult {
    log_to_stderr(LevelFilter::WARN);
    match &args.resume {
        Some(folder) => resume(folder, &args.given),
        None => play(args),
    }
}

fn play(args: AgentArgs) -> CommandResult {
    let arguments = args.agent.arguments(args.agent.limit_s(LIMIT_S)).into_iter();
    let arguments = arguments.chain(args.robot_models.arguments()).collect();
    let agent = PythonModule::new(PythonPart::Agent, arguments)?;
    let (token, text) = Token::random()?;
    let world = args.world.layer();
    let layer = Layer { runs: Some(args.runs), assistance: Some(args.assistance), ..world };
    let settings = Settings::resolve(on_this_machine(layer, token), None)?;
    let task = match &args.task {
        Some(id) => settings.tasks.find(id)?.clone(),
        None => settings.tasks.first_of_files().cloned().map_or_else(|| tasks::find(demo::TASK), Ok)?,
    };
    let kept = [
        format!("--runs={}", settings.runs.display()),
        format!("--assistance={}", args.assistance.name()),
        format!("--server-flags={}", world_flags(&args.given)),
    ];
    let switches = [(args.per_robot, "--per-robot"), (args.talk, "--talk")];
    let plays = args.seeds.0.map(|seed| {
        let episode = ["--task".into(), task.id.clone(), "--seed".into(), seed.to_string()];
        let switches = switches.iter().filter(|(given, _)| *given).map(|(_, flag)| (*flag).into());
        kept.iter().cloned().chain(episode).chain(switches).collect()
    });
    play_each(&agent, settings, &text, plays.collect())
}

/// Resumes the episode of `folder`, which a server on the parent folder of all runs restores. Python refuses
/// incompatible flags before the server starts.
fn resume(folder: &Path, given: &GivenFlags) -> CommandResult {
    let agent = PythonModule::new(PythonPart::Agent, resumed_arguments(given))?;
    let folder = folder.canonicalize()?;
    let kept: AgentFile = serde_json::from_slice(&fs::read(folder.join(AGENT_FILE))?)?;
    let (token, text) = Token::random()?;
    let runs = folder.parent().map(Path::to_owned);
    let layer = Layer { runs, assistance: Some(kept.flags.assistance), ..Layer::default() };
    play_each(&agent, Settings::resolve(on_this_machine(layer, token), None)?, &text, vec![Vec::new()])
}

/// Returns the settings of a server that only this machine can reach.
fn on_this_machine(layer: Layer, token: Token) -> Layer {
    Layer { listen: Some((Ipv4Addr::LOCALHOST, FREE_PORT).into()), token: Some(token), ..layer }
}

/// Returns the given flags of the world in the form in which Python stores them.
fn world_flags(given: &GivenFlags) -> Value {
    let flags = given.of::<WorldFlags>().into_iter();
    flags.map(|(flag, value)| (flag.replace('-', "_"), Value::from(value))).collect::<Map<_, _>>().into()
}

/// Returns the arguments for Python when an episode is resumed. They contain only the given flags, because
/// defaults may differ from the flags of the episode.
fn resumed_arguments(given: &GivenFlags) -> Vec<String> {
    let world = given.of::<WorldFlags>();
    let own = given.of::<AgentArgs>().into_iter().filter(|flag| !world.contains(flag));
    let own = own.map(|(flag, value)| match (flag.as_str(), value) {
        ("seeds", Some(seed)) => format!("--seed={seed}"),
        (_, Some(value)) => format!("--{flag}={value}"),
        (_, None) => format!("--{flag}"),
    });
    own.chain([format!("--server-flags={}", world_flags(given))]).collect()
}

/// Lets Python play one episode after another on a server in this process, each with its own arguments.
fn play_each(
    agent: &PythonModule,
    settings: Arc<Settings>,
    token: &str,
    plays: Vec<Vec<String>>,
) -> CommandResult {
    try_runs_folder(&settings.runs)?;
    let runs = settings.runs.clone();
    let server = Server::start(settings)?;
    let url = format!("http://{}", server.address());
    let mut ended = None;
    let child = Arc::new(AtomicU32::new(NO_CHILD));
    hand_on_signals(child.clone());
    for play in plays {
        let further: Vec<&str> = ["--url", &url].into_iter().chain(play.iter().map(String::as_str)).collect();
        let mut playing = agent.command(&further).env("TANDEM_TOKEN", token).spawn()?;
        child.store(playing.id(), Ordering::SeqCst);
        let status = playing.wait()?;
        ended = Some(status);
        if !status.success() {
            break;
        }
    }
    // A process without an exit code was killed, and has not ended its episode.
    let was_killed = ended.is_some_and(|status| status.code().is_none());
    let shown = shell_word(&runs.to_string_lossy());
    if was_killed {
        server.stop_keeping();
        eprintln!(
            "the agent was killed; tandem agent --resume, with the folder of its episode in {shown}, goes on"
        );
    } else {
        server.stop();
    }
    println!("to look at it in a browser: tandem serve --runs {shown}, and the link that it prints");
    Ok(exit_code(ended.is_none_or(|status| status.success())))
}

fn exit_code(is_success: bool) -> ExitCode {
    match is_success {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}

/// Forwards the first signal that would end this process to the running child, which then ends its episode. A
/// second signal ends this process immediately.
fn hand_on_signals(child: Arc<AtomicU32>) {
    thread::spawn(move || -> io::Result<()> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        runtime.block_on(shutdown_signal());
        ask_to_end(child.load(Ordering::SeqCst));
        runtime.block_on(shutdown_signal());
        std::process::exit(INTERRUPTED);
    });
}

#[cfg(unix)]
fn ask_to_end(id: u32) {
    use rustix::process::{Pid, Signal, kill_process};
    if let Some(pid) = id.try_into().ok().and_then(Pid::from_raw) {
        // The call fails if the child has ended, which is not an error here.
        let _ = kill_process(pid, Signal::TERM);
    }
}

#[cfg(not(unix))]
fn ask_to_end(_: u32) {}
