//! `tandem demo`: the gateway in this process, and the scripted expert that plays the Handover task over real HTTP.

use std::{
    error::Error,
    net::{Ipv4Addr, SocketAddr},
    process::ExitCode,
    sync::Arc,
};

use indicatif::{ProgressBar, ProgressStyle};
use tandem_episodes::{
    Facts,
    experts::{self, Arena, ExpertError},
    tasks,
};
use tandem_tools_spec::{CommandReply, Protocol, ResultReply, StartEpisode, ToolCall, ToolReply};

use crate::{
    episode_thread::EpisodeThread,
    http_caller::{HttpEpisode, HttpError},
    seeds::Seeds,
    server::Server,
    settings::Settings,
};

const TASK: &str = "handover";
const LAST_PHASE: &str = "p3";

/// Plays every seed in turn. Succeeds if the last phase was reached on 80 % of them, which for one seed means on that seed.
pub fn run(settings: &Settings, seeds: Seeds) -> Result<ExitCode, Box<dyn Error>> {
    let free_port = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
    let server = Server::start(&Settings { listen: free_port, ..settings.clone() })?;
    let (mut played, mut placed) = (0, 0);
    for seed in seeds.0 {
        let result = play(&server, seed)?;
        played += 1;
        placed += u32::from(result.phases.reached_s(LAST_PHASE).is_some());
    }
    server.stop();
    if played > 1 {
        println!("{LAST_PHASE} on {placed} of {played}");
    }
    Ok(if placed * 10 >= played * 8 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn play(server: &Server, seed: u32) -> Result<ResultReply, Box<dyn Error>> {
    let task = tasks::find(TASK)?;
    let args = StartEpisode { task: TASK.into(), seed, protocol: Some(Protocol::Agentic) };
    println!("{TASK}, seed {seed}, over http://{}", server.address());
    let (http, started) = HttpEpisode::start(server.address(), &args)?;
    let thread = server.table().get(&started.episode_id)?;
    let mut arena = OverHttp { http, thread, progress: Progress::new(task.phases.len()) };
    let outcome = experts::perform(task, &mut arena);
    let OverHttp { http, thread, progress } = arena;
    progress.bar.finish_and_clear();
    let result = http.delete()?;
    if let Err(error) = outcome {
        println!("  the expert gave up: {error}");
    }
    print_result(&result, &thread);
    Ok(result)
}

fn print_result(result: &ResultReply, thread: &EpisodeThread) {
    for (id, time_s) in &result.phases.0 {
        match time_s {
            Some(time_s) => println!("  {id} reached at {time_s:.2} s"),
            None => println!("  {id} not reached"),
        }
    }
    println!(
        "  {} control steps, {} tool calls, {} falls, {:.1}x real time",
        result.env_steps, result.tool_calls, result.falls, result.realtime_factor
    );
    println!("  files in {}", thread.folder().display());
}

/// The expert's way to its episode: it acts over HTTP like any policy, and looks behind the curtain in this process.
struct OverHttp {
    http: HttpEpisode,
    thread: Arc<EpisodeThread>,
    progress: Progress,
}

impl Arena for OverHttp {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, ExpertError> {
        let reply = self.http.call(&call).map_err(|error| match error {
            HttpError::Refused(problem) if problem.kind.ends_with(":ended") => ExpertError::EpisodeOver,
            error => ExpertError::Call { tool: call.name(), reason: error.to_string() },
        })?;
        if let ToolReply::Command(reply) = &reply {
            self.progress.show(reply);
        }
        Ok(reply)
    }

    fn facts(&mut self) -> Result<Facts, ExpertError> {
        self.thread
            .facts_blocking()
            .map_err(|error| ExpertError::Call { tool: "facts", reason: error.to_string() })
    }
}

/// A bar that counts phases, because how many steps a phase takes is not known before.
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
