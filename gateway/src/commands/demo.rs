//! `tandem demo`: the gateway in this process, and the scripted expert that plays the Handover task over real
//! HTTP.

use std::{
    error::Error,
    net::{Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use indicatif::{ProgressBar, ProgressStyle};
use tandem_episodes::{
    EpisodeSpec, Facts,
    players::{self, Episode, PlayerError, PrivilegedEpisode, experts},
    shell_word,
    tasks::{self, Task},
};
use tandem_tools_spec::{CommandReply, Protocol, ResultReply, StartEpisode, ToolCall, ToolReply};
use tracing_subscriber::filter::LevelFilter;

use super::{
    CommandResult, Seeds,
    flags::{StressFlags, WorldFlags},
    logging::log_to_stderr,
};
use crate::{
    drivers::HttpEpisode,
    hosting::{EpisodeThread, try_runs_folder},
    http::Server,
    settings::{Layer, Settings},
};

pub(super) const TASK: &str = "handover";
/// Port number that makes the system pick a free port.
const FREE_PORT: u16 = 0;

/// Percentage of episodes that have to reach the last phase.
const PASS_PERCENT: usize = 80;

/// Play the Handover task with its scripted expert over real HTTP, and record it. --task-file replaces the
/// task; without an expert for it, the robots do nothing.
#[derive(Debug, clap::Args)]
pub struct DemoArgs {
    /// One seed, or a range of seeds as 0-9 or 0..9, both ends included.
    #[arg(long, alias = "seed", default_value = "0", value_name = "SEEDS")]
    seeds: Seeds,
    /// Folder for results, one folder per episode.
    #[arg(long, env = "TANDEM_RUNS", default_value = "runs", value_name = "DIR")]
    runs: PathBuf,
    #[command(flatten)]
    world: WorldFlags,
    #[command(flatten)]
    stress: StressFlags,
}

/// Plays every seed. The program fails if too few episodes reach the last phase.
pub fn run(args: DemoArgs) -> CommandResult {
    log_to_stderr(LevelFilter::WARN);
    let known = args.world.read_task_files()?.first().is_none_or(experts::solves);
    let results = play_all(&args.runs, args.seeds, args.stress.over(args.world.layer()))?;
    let recorded = results.iter().all(|result| result.recording_failed.is_none());
    Ok(if recorded && (!known || passed(&results)) { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Plays the seeds one after another on a server with these flags, recorded under `runs`, and prints the
/// results.
pub fn play_all(runs: &Path, seeds: Seeds, flags: Layer) -> Result<Vec<ResultReply>, Box<dyn Error>> {
    let flags = Layer {
        listen: Some(SocketAddr::from((Ipv4Addr::LOCALHOST, FREE_PORT))),
        runs: Some(runs.into()),
        ..flags
    };
    let settings = Settings::resolve(flags, None)?;
    try_runs_folder(&settings.runs)?;
    let task = settings.tasks.first_of_files().cloned().map_or_else(|| tasks::find(TASK), Ok)?;
    let server = Server::start(settings)?;
    let results = seeds.0.map(|seed| play(&server, &task, seed)).collect::<Result<Vec<_>, _>>()?;
    server.stop();
    if results.len() > 1 {
        println!("p{} on {} of {}", task.phases.len(), count_last_phase(&results), results.len());
    }
    Ok(results)
}

/// Returns true if at least 80 % of the episodes reached the last phase. A single episode has to reach it.
pub fn passed(results: &[ResultReply]) -> bool {
    count_last_phase(results) * 100 >= results.len() * PASS_PERCENT
}

fn count_last_phase(results: &[ResultReply]) -> usize {
    let last_s = |result: &ResultReply| result.phases.0.last().and_then(|(_, time_s)| *time_s);
    results.iter().filter(|result| last_s(result).is_some()).count()
}

fn play(server: &Server, task: &Task, seed: u32) -> Result<ResultReply, Box<dyn Error>> {
    let spec = EpisodeSpec::new(task, seed, Protocol::Agentic);
    let args = StartEpisode { task: task.id.clone(), seed, protocol: Some(spec.protocol), short: false };
    let (http, started) = HttpEpisode::start(server.address(), &args)?;
    let assistance = started.briefing.status.assistance;
    println!("{}, seed {seed}, over http://{}, assistance {assistance}", task.id, server.address());
    let thread = server.table().get(&started.episode_id)?;
    let mut episode = OverHttp { http, thread, progress: Progress::new(task.phases.len()) };
    let outcome = players::expert_or_nobody(task)?.play(&spec, &mut episode);
    let OverHttp { http, thread, progress } = episode;
    progress.bar.finish_and_clear();
    let result = http.delete()?;
    if let Err(error) = outcome {
        println!("  the expert gave up: {error}");
    } else if !experts::solves(task) {
        println!("  no expert knows {}, so nobody acted", task.id);
    }
    print_result(task, &result, thread.folder());
    Ok(result)
}

fn print_result(task: &Task, result: &ResultReply, folder: &Path) {
    for ((number, time_s), phase) in result.phases.0.iter().zip(task.phases.iter()) {
        match time_s {
            Some(time_s) => println!("  {number} {} reached at {time_s:.2} s", phase.id),
            None => println!("  {number} {} not reached", phase.id),
        }
    }
    println!(
        "  {} control steps of 20 ms, {} tool calls, {} falls, {:.1}x real time on one thread",
        result.env_steps, result.tool_calls, result.falls, result.realtime_factor
    );
    match &result.recording_failed {
        Some(reason) => println!("  not everything was written: {reason}"),
        None => {
            println!("  {}: result.json, episode.mcap, strip.png, report.html", folder.display());
            let runs = shell_word(&folder.parent().unwrap_or(folder).to_string_lossy());
            println!(
                "  to look at it step by step in a browser: tandem serve --runs {runs}, and the link that it prints"
            );
        }
    }
}

/// An episode of the expert, which acts over HTTP like any policy and reads the true state in this process.
struct OverHttp {
    http: HttpEpisode,
    thread: Arc<EpisodeThread>,
    progress: Progress,
}

impl Episode for OverHttp {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let reply = self.http.call(call)?;
        if let ToolReply::Act(reply) = &reply {
            self.progress.show(reply);
        }
        Ok(reply)
    }
}

impl PrivilegedEpisode for OverHttp {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.thread
            .facts_blocking()
            .map_err(|error| PlayerError::Call { tool: "facts", reason: error.to_string() })
    }
}

/// A progress bar that counts phases, because the number of steps of a phase is not known beforehand.
struct Progress {
    bar: ProgressBar,
}

impl Progress {
    fn new(phases: usize) -> Progress {
        let template = "  [{bar:30}] {pos} of {len} phases, {msg}";
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        Progress { bar: ProgressBar::new(phases as u64).with_style(style.progress_chars("=> ")) }
    }

    fn show(&self, reply: &CommandReply) {
        self.bar.set_position(reply.phases.len() as u64);
        self.bar.set_message(format!("{:.1} s, {} steps left", reply.time_s, reply.budget.steps_left));
    }
}
