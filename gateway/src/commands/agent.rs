//! `tandem agent`: a language model plays episodes on a server in this process, and what it says and does is printed.

use std::{
    io,
    net::Ipv4Addr,
    path::PathBuf,
    process::ExitCode,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
    thread,
};

use tandem_episodes::{shell_word, tasks};
use tandem_tools_spec::Assistance;
use tracing_subscriber::filter::LevelFilter;

use super::{
    CommandResult, Seeds, demo,
    flags::{AgentFlags, WorldFlags},
    logging::log_to_stderr,
};
use crate::{
    drivers::{PythonModule, PythonPart},
    hosting::try_runs_folder,
    http::{Server, shutdown_signal},
    settings::{Layer, Settings, one_of},
    token::Token,
};

/// Has the system pick a free port.
const FREE_PORT: u16 = 0;

/// How long a model may take for an episode, where nobody says otherwise.
const LIMIT_S: u32 = 3600;

/// No process has this number.
const NO_CHILD: u32 = 0;

/// What shells report of a process that SIGINT has ended.
const INTERRUPTED: i32 = 130;

/// Have a language model play a task, by any endpoint that speaks OpenAI's or Anthropic's formats. Python plays: pip install
/// './gateway/python[agents]' in a checkout of the repository. Keys are read from the environment: OPENAI_API_KEY, ANTHROPIC_API_KEY.
#[allow(
    rustdoc::broken_intra_doc_links,
    reason = "the command line's help names an extra of the wheel, and no link"
)]
#[derive(Debug, clap::Args)]
pub struct AgentArgs {
    #[command(flatten)]
    agent: AgentFlags,
    /// The id of the task [default: that of --task-file, or else handover].
    #[arg(long, value_name = "TASK")]
    task: Option<String>,
    /// One seed, or a range of seeds as 0-9 or 0..9, both ends included.
    #[arg(long, alias = "seed", default_value = "0", value_name = "SEEDS")]
    seeds: Seeds,
    /// What the model is told, as for `serve`.
    #[arg(long, env = "TANDEM_ASSISTANCE", value_name = "WHAT", value_parser = one_of(Assistance::ALL, Assistance::name),
          default_value = Assistance::Full.name())]
    assistance: Assistance,
    /// A model for each robot, which sees and commands that robot alone.
    #[arg(long)]
    per_robot: bool,
    /// With --per-robot: let the models talk to each other by the tool say.
    #[arg(long, requires = "per_robot")]
    talk: bool,
    /// Folder that recordings are written to, one folder per episode.
    #[arg(long, env = "TANDEM_RUNS", default_value = "runs", value_name = "DIR")]
    runs: PathBuf,
    #[command(flatten)]
    world: WorldFlags,
}

/// Plays every seed. The program fails where the model's endpoint gives no answer.
pub fn run(args: AgentArgs) -> CommandResult {
    log_to_stderr(LevelFilter::WARN);
    let agent = PythonModule::new(PythonPart::Agent, args.agent.arguments(args.agent.limit_s(LIMIT_S)))?;
    let (token, text) = Token::random()?;
    let flags = Layer {
        listen: Some((Ipv4Addr::LOCALHOST, FREE_PORT).into()),
        token: Some(token),
        runs: Some(args.runs),
        assistance: Some(args.assistance),
        ..args.world.layer()
    };
    let settings = Settings::resolve(flags, None)?;
    try_runs_folder(&settings.runs)?;
    let task = match &args.task {
        Some(id) => settings.tasks.find(id)?,
        None => settings.tasks.first_of_files().map_or_else(|| tasks::find(demo::TASK), Ok)?,
    };
    let runs = settings.runs.clone();
    let server = Server::start(settings)?;
    let url = format!("http://{}", server.address());
    let switches = [(args.per_robot, "--per-robot"), (args.talk, "--talk")];
    let mut failed = false;
    let child = Arc::new(AtomicU32::new(NO_CHILD));
    hand_on_signals(child.clone());
    for seed in args.seeds.0 {
        let seed = seed.to_string();
        let mut further = vec!["--url", &url, "--task", task.id, "--seed", &seed];
        further.extend(switches.iter().filter(|(given, _)| *given).map(|(_, flag)| *flag));
        let mut command = agent.command(&further);
        let mut playing = command.env("TANDEM_TOKEN", &text).spawn()?;
        child.store(playing.id(), Ordering::SeqCst);
        if !playing.wait()?.success() {
            failed = true;
            break;
        }
    }
    server.stop();
    println!(
        "to look at it in a browser: tandem serve --runs {}, and the link that it prints",
        shell_word(&runs.to_string_lossy())
    );
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Has the first signal that would end this process ask the child that runs then to end its episode; a second one does not wait
/// for that.
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
        // The call fails where the child is gone, which is what is wanted.
        let _ = kill_process(pid, Signal::TERM);
    }
}

#[cfg(not(unix))]
fn ask_to_end(_: u32) {}
