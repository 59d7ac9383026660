//! Agents as programs: a fresh process for each episode, or for each of its robots, which finds a server with that one episode at
//! an address in its environment, and is stopped with all that it started when the episode or its time is over.

mod brief;
mod ending;
mod part;
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
    EpisodeSpec, RunFolder, Visibility, create_private_folder,
    players::{Fared, Place, PlayError, Policy, PolicyCard},
};
use tandem_tools_spec::{Driving, ResultReply, StartReply};

use crate::{
    hosting::{EpisodeThread, HostingError},
    http::Server,
    settings::{Layer, Record, Settings, SettingsError},
    token::Token,
};
use ending::Leaving;
use part::Part;
use process::{Crowd, Group};

/// How long a program may go on when its episode has ended.
const LAST_WORDS: Duration = Duration::from_secs(10);

/// How often it is looked at.
const ROUND: Duration = Duration::from_millis(50);

/// A command that plays.
#[derive(Debug)]
pub struct Program {
    command: String,
    /// Whether one process directs all robots, or one each.
    driving: Driving,
    /// Longest that one of its processes may run.
    limit: Duration,
    settings: Arc<Settings>,
    processes: Arc<Crowd>,
}

impl Program {
    /// Episodes played by `command`, which a shell reads. A signal that ends this process ends those of the program, too.
    pub fn new(command: String, driving: Driving, limit: Duration) -> Result<Program, SettingsError> {
        let flags = Layer {
            listen: Some(([127, 0, 0, 1], 0).into()),
            max_episodes: Some(1),
            // Where a program that has a shell could look behind the curtain, nothing lies while it runs.
            record: Some(Record::After),
            ..Layer::default()
        };
        let processes = Arc::new(Crowd::default());
        process::end_with_us(&processes);
        Ok(Program { command, driving, limit, settings: Settings::resolve(flags, None)?, processes })
    }

    /// Those of a server for this episode alone.
    fn settings_for(&self, spec: &EpisodeSpec, token: Token, folder: &Path) -> Arc<Settings> {
        Arc::new(Settings {
            token: Some(token),
            runs: folder.join("others"),
            disclosure: spec.disclosure,
            hints: spec.hints,
            locomotion: spec.locomotion.clone(),
            renderer: spec.renderer,
            ..(*self.settings).clone()
        })
    }

    /// Starts a process for each part and waits until they are gone. Returns how each left, and its status.
    fn run(
        &self,
        server: &Server,
        episode: &EpisodeThread,
        start: &StartReply,
        parts: &[Part],
    ) -> Result<Vec<(Leaving, String)>, PlayError> {
        let url = format!("http://{}", server.address());
        let mut groups = Vec::new();
        for part in parts {
            part.write(start, &url, &self.driving)?;
        }
        for part in parts {
            let environment = part.environment(start, &url);
            let group = Group::start(&self.processes, &self.command, &environment, &part.folder);
            groups.push(group.map_err(|error| lost("the program cannot be started", error))?);
        }
        let leavings =
            self.watch(&mut groups, episode).map_err(|error| lost("the program is lost", error))?;
        let statuses: io::Result<Vec<String>> = groups.into_iter().map(Group::stop).collect();
        let statuses = statuses.map_err(|error| lost("the program is lost", error))?;
        Ok(leavings.into_iter().zip(statuses).collect())
    }

    fn watch(&self, groups: &mut [Group], episode: &EpisodeThread) -> io::Result<Vec<Leaving>> {
        let began = Instant::now();
        let mut over: Option<Instant> = None;
        loop {
            let ended: Vec<bool> = groups.iter_mut().map(Group::has_ended).collect::<io::Result<_>>()?;
            let late = began.elapsed() >= self.limit;
            let stay = episode.ended() && over.get_or_insert_with(Instant::now).elapsed() >= LAST_WORDS;
            if late || stay || ended.iter().all(|ended| *ended) {
                let leaving = |ended: bool| match (ended, late) {
                    (true, _) => Leaving::Left,
                    (false, true) => Leaving::OutOfTime(self.limit),
                    (false, false) => Leaving::Stays,
                };
                return Ok(ended.into_iter().map(leaving).collect());
            }
            thread::sleep(ROUND);
        }
    }
}

impl Policy for Program {
    fn card(&self) -> PolicyCard {
        let mut settings = json!({ "command": self.command, "limit_s": self.limit.as_secs_f64() });
        let mut name = format!("exec:{}", self.command);
        if self.driving.is_per_robot() {
            name.push_str(" per robot");
            settings["patience_s"] = self.driving.patience_s().into();
            settings["talk"] = (self.driving.talk == Some(true)).into();
        }
        PolicyCard { settings: Some(settings), ..name.as_str().into() }
    }

    fn play_whole(&self, spec: &EpisodeSpec, place: Place) -> Result<Fared, PlayError> {
        let folder = place.folder;
        create_private_folder(folder).map_err(|error| lost("no folder for the episode", error))?;
        let absolute = folder.canonicalize().map_err(|error| lost("no folder for the episode", error))?;
        forget(&absolute.join(tandem_episodes::RESULT_FILE))?;
        let (token, text) = Token::random().map_err(HostingError::from)?;
        let server = Server::start(self.settings_for(spec, token, &absolute));
        let server = server.map_err(|error| lost("no server", error))?;
        let id = format!("{}-seed{}", spec.task.id, spec.seed);
        let files = RunFolder { path: absolute.clone(), visibility: Visibility::After };
        let (episode, start) = server.host(&id, spec.clone(), &self.driving, files)?;
        let parts = Part::all(&start, &text, &absolute);
        let ran = self.run(&server, &episode, &start, &parts);
        let over = episode.ended();
        let thought = episode.thought();
        drop(episode);
        server.stop();
        let ran = ran?;
        let result = read_result(&absolute)?;
        let reasons = ran.iter().zip(&parts).filter_map(|((leaving, status), part)| {
            let reason = leaving.reason(status, over, &result, &part.folder)?;
            Some(part.robot.map_or(reason.clone(), |robot| format!("{robot}: {reason}")))
        });
        let reasons: Vec<String> = reasons.collect();
        let stopped = (!reasons.is_empty()).then(|| reasons.join("; "));
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
