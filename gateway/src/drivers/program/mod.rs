//! Agents as programs: a fresh process for each episode, which finds a server with that one episode at an address in its
//! environment, and is stopped with all that it started when the episode or its time is over.

mod brief;
mod ending;
mod process;

use std::{
    fs, io,
    path::Path,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use serde_json::json;
use tandem_episodes::{
    EpisodeError, EpisodeSpec, OutputError, RunFolder, Visibility, create_private_folder,
    players::{Fared, Place, PlayError, Policy, PolicyCard},
    write_whole,
};
use tandem_tools_spec::{ResultReply, StartReply};

use crate::{
    hosting::{EpisodeThread, HostingError},
    http::Server,
    settings::{Layer, Record, Settings, SettingsError},
};
use brief::brief;
use ending::Leaving;
use process::{Crowd, Group};

/// How long a program may go on when its episode has ended.
const LAST_WORDS: Duration = Duration::from_secs(10);

/// How often it is looked at.
const ROUND: Duration = Duration::from_millis(50);

/// A command that plays.
#[derive(Debug)]
pub struct Program {
    command: String,
    /// Longest that one of its processes may run.
    limit: Duration,
    settings: Arc<Settings>,
    processes: Arc<Crowd>,
}

impl Program {
    /// Episodes played by `command`, which a shell reads. A signal that ends this process ends those of the program, too.
    pub fn new(command: String, limit: Duration) -> Result<Program, SettingsError> {
        let flags = Layer {
            listen: Some(([127, 0, 0, 1], 0).into()),
            max_episodes: Some(1),
            // Where a program that has a shell could look behind the curtain, nothing lies while it runs.
            record: Some(Record::After),
            ..Layer::default()
        };
        let processes = Arc::new(Crowd::default());
        process::end_with_us(&processes);
        Ok(Program { command, limit, settings: Settings::resolve(flags, None)?, processes })
    }

    /// Those of a server for this episode alone.
    fn settings_for(&self, spec: &EpisodeSpec, folder: &Path) -> Arc<Settings> {
        Arc::new(Settings {
            runs: folder.join("others"),
            disclosure: spec.disclosure,
            hints: spec.hints,
            locomotion: spec.locomotion.clone(),
            renderer: spec.renderer,
            ..(*self.settings).clone()
        })
    }

    /// Starts a process for the episode and waits until it is gone.
    fn run(
        &self,
        server: &Server,
        episode: &EpisodeThread,
        start: &StartReply,
        folder: &Path,
    ) -> Result<(Leaving, String), PlayError> {
        let url = format!("http://{}", server.address());
        let kept = |name: &str, text: &str| {
            write_whole(&folder.join(name), text.as_bytes()).map_err(EpisodeError::from)
        };
        kept(brief::FILE, &brief(start, &url))?;
        kept(
            START_FILE,
            &serde_json::to_string_pretty(start).map_err(OutputError::from).map_err(EpisodeError::from)?,
        )?;
        let environment = environment(&url, start, folder);
        let group = Group::start(&self.processes, &self.command, &environment, folder);
        let mut group = group.map_err(|error| lost("the program cannot be started", error))?;
        let leaving = self.watch(&mut group, episode).map_err(|error| lost("the program is lost", error))?;
        let status = group.stop().map_err(|error| lost("the program is lost", error))?;
        Ok((leaving, status))
    }

    fn watch(&self, group: &mut Group, episode: &EpisodeThread) -> io::Result<Leaving> {
        let began = Instant::now();
        let mut over: Option<Instant> = None;
        loop {
            if group.has_ended()? {
                return Ok(Leaving::Left);
            }
            if began.elapsed() >= self.limit {
                return Ok(Leaving::OutOfTime(self.limit));
            }
            if episode.ended() && over.get_or_insert_with(Instant::now).elapsed() >= LAST_WORDS {
                return Ok(Leaving::Stays);
            }
            thread::sleep(ROUND);
        }
    }
}

/// What the server said at the start, for programs that read JSON.
const START_FILE: &str = "start.json";

/// What the program finds in its environment, beside ours.
fn environment(url: &str, start: &StartReply, folder: &Path) -> Vec<(&'static str, String)> {
    // A server that asks for a token would have it told here, as TANDEM_TOKEN.
    vec![
        ("TANDEM_URL", url.into()),
        ("TANDEM_EPISODE", start.episode_id.clone()),
        ("TANDEM_START", folder.join(START_FILE).display().to_string()),
    ]
}

impl Policy for Program {
    fn card(&self) -> PolicyCard {
        let settings = json!({ "command": self.command, "limit_s": self.limit.as_secs_f64() });
        PolicyCard { settings: Some(settings), ..format!("exec:{}", self.command).as_str().into() }
    }

    fn play_whole(&self, spec: &EpisodeSpec, place: Place) -> Result<Fared, PlayError> {
        let folder = place.folder;
        create_private_folder(folder).map_err(|error| lost("no folder for the episode", error))?;
        let absolute = folder.canonicalize().map_err(|error| lost("no folder for the episode", error))?;
        forget(&absolute.join(tandem_episodes::RESULT_FILE))?;
        let server = Server::start(self.settings_for(spec, &absolute));
        let server = server.map_err(|error| lost("no server", error))?;
        let id = format!("{}-seed{}", spec.task.id, spec.seed);
        let files = RunFolder { path: absolute.clone(), visibility: Visibility::After };
        let (episode, start) = server.host(&id, spec.clone(), files)?;
        let ran = self.run(&server, &episode, &start, &absolute);
        let over = episode.ended();
        let thought = episode.thought();
        drop(episode);
        server.stop();
        let (leaving, status) = ran?;
        let result = read_result(&absolute)?;
        let stopped = leaving.reason(&status, over, &result, &absolute);
        Ok(Fared { result, thought, stopped })
    }
}

/// Removes what an interrupted run has left.
fn forget(path: &Path) -> Result<(), PlayError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(lost("an old result stays", error)),
        _ => Ok(()),
    }
}

/// The result as the server has left it: a program may have ended its episode in any way.
fn read_result(folder: &Path) -> Result<ResultReply, PlayError> {
    let bytes =
        fs::read(folder.join(tandem_episodes::RESULT_FILE)).map_err(|error| lost("no result", error))?;
    serde_json::from_slice(&bytes).map_err(|error| lost("no result", error.into()))
}

fn lost(what: &str, error: io::Error) -> PlayError {
    PlayError::Lost(format!("{what}: {error}"))
}

impl From<HostingError> for PlayError {
    fn from(error: HostingError) -> PlayError {
        match error {
            HostingError::Episode(error) => PlayError::Episode(error),
            error => PlayError::Lost(error.to_string()),
        }
    }
}
