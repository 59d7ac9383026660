//! Agents as programs: a fresh process for each episode, or for each of its robots, which finds a server with that one episode at
//! an address in its environment, and is stopped with all that it started when the episode or its time is over.

mod participant;
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
    players::{EpisodeOutput, PlayError, PlayOutcome, Policy},
    results::PolicyCard,
};
use tandem_tools_spec::{Driving, EndReason, ResultReply, StartReply};

use crate::{
    hosting::{EpisodeThread, HostingError},
    http::Server,
    settings::{Layer, Record, Settings, SettingsError},
    token::Token,
};
use participant::Participant;
use process::{ProcessGroup, ProcessGroups, STDERR_FILE, STDOUT_FILE};

/// How long a program may go on when its episode has ended.
const GRACE_PERIOD: Duration = Duration::from_secs(10);

/// How often programs are looked at.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// How much of a program's last line a result quotes.
const LAST_LINE_CHARS: usize = 300;

/// A command that plays.
#[derive(Debug)]
pub struct Program {
    command: String,
    /// Whether one process directs all robots, or one each.
    driving: Driving,
    /// Longest that one of its processes may run.
    limit: Duration,
    settings: Arc<Settings>,
    processes: Arc<ProcessGroups>,
}

impl Program {
    /// Episodes played by `command`, which a shell reads. A signal that ends this process ends those of the program, too.
    pub fn new(command: String, driving: Driving, limit: Duration) -> Result<Program, SettingsError> {
        let flags = Layer {
            listen: Some(([127, 0, 0, 1], 0).into()),
            max_episodes: Some(1),
            // A program that has a shell could read files, so nothing is written where it could look while it runs.
            record: Some(Record::After),
            ..Layer::default()
        };
        let processes = Arc::new(ProcessGroups::default());
        process::stop_on_shutdown(&processes);
        Ok(Program { command, driving, limit, settings: Settings::resolve(flags, None)?, processes })
    }

    /// The settings of a server for this episode alone.
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

    /// Starts a process for each participant and waits until all are gone. Returns how each was found, and its exit status.
    fn run(
        &self,
        server: &Server,
        episode: &EpisodeThread,
        start: &StartReply,
        participants: &[Participant],
    ) -> Result<Vec<(ProgramExit, String)>, PlayError> {
        let url = format!("http://{}", server.address());
        let mut groups = Vec::new();
        for participant in participants {
            participant.write(start, &url, &self.driving)?;
        }
        for participant in participants {
            let environment = participant.environment(start, &url);
            let group =
                ProcessGroup::start(&self.processes, &self.command, &environment, &participant.folder);
            groups.push(group.map_err(|error| lost("the program cannot be started", error))?);
        }
        let exits = self.watch(&mut groups, episode).map_err(|error| lost("the program is lost", error))?;
        let statuses: io::Result<Vec<String>> = groups.into_iter().map(ProcessGroup::stop).collect();
        let statuses = statuses.map_err(|error| lost("the program is lost", error))?;
        Ok(exits.into_iter().zip(statuses).collect())
    }

    fn watch(&self, groups: &mut [ProcessGroup], episode: &EpisodeThread) -> io::Result<Vec<ProgramExit>> {
        let began = Instant::now();
        let mut over: Option<Instant> = None;
        loop {
            let ended: Vec<bool> =
                groups.iter_mut().map(ProcessGroup::has_ended).collect::<io::Result<_>>()?;
            let late = began.elapsed() >= self.limit;
            let stay = episode.ended() && over.get_or_insert_with(Instant::now).elapsed() >= GRACE_PERIOD;
            if late || stay || ended.iter().all(|ended| *ended) {
                let exit = |ended: bool| match (ended, late) {
                    (true, _) => ProgramExit::Ended,
                    (false, true) => ProgramExit::TimedOut(self.limit),
                    (false, false) => ProgramExit::StillRunning,
                };
                return Ok(ended.into_iter().map(exit).collect());
            }
            thread::sleep(POLL_INTERVAL);
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

    fn play_episode(&self, spec: &EpisodeSpec, place: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        let folder = place.folder;
        create_private_folder(folder).map_err(|error| lost("no folder for the episode", error))?;
        let absolute = folder.canonicalize().map_err(|error| lost("no folder for the episode", error))?;
        remove_old_result(&absolute.join(tandem_episodes::RESULT_FILE))?;
        let (token, text) = Token::random().map_err(HostingError::from)?;
        let server = Server::start(self.settings_for(spec, token, &absolute));
        let server = server.map_err(|error| lost("no server", error))?;
        let id = format!("{}-seed{}", spec.task.id, spec.seed);
        let files = RunFolder { path: absolute.clone(), visibility: Visibility::After };
        let (episode, start) = server.host(&id, spec.clone(), &self.driving, files)?;
        if let Some(reason) = start.briefing.recording_failed {
            return Err(PlayError::Lost(reason));
        }
        let participants = Participant::all(&start, &text, &absolute);
        let ran = self.run(&server, &episode, &start, &participants);
        let over = episode.ended();
        let thought = episode.thought();
        drop(episode);
        server.stop();
        let ran = ran?;
        let result = read_result(&absolute)?;
        let reasons = ran.iter().zip(&participants).filter_map(|((exit, status), participant)| {
            let reason = exit.failure(status, over, &result, &participant.folder)?;
            Some(participant.robot.map_or(reason.clone(), |robot| format!("{robot}: {reason}")))
        });
        let reasons: Vec<String> = reasons.collect();
        let stopped = (!reasons.is_empty()).then(|| reasons.join("; "));
        Ok(PlayOutcome { result, thought, stopped })
    }
}

/// How a program was found when the wait for it was over.
enum ProgramExit {
    /// It ended by itself.
    Ended,
    /// Its episode is over, and it still runs.
    StillRunning,
    /// It ran for longer than this limit.
    TimedOut(Duration),
}

impl ProgramExit {
    /// What kept a program from playing its episode to the end, if anything did. `status` is the exit status of the program, `over`
    /// says whether the episode had ended by then, and `folder` has the program's output.
    fn failure(&self, status: &str, over: bool, result: &ResultReply, folder: &Path) -> Option<String> {
        match (self, over, result.ended) {
            (ProgramExit::TimedOut(limit), ..) => {
                Some(format!("the program was stopped after {} s", limit.as_secs_f64()))
            }
            (_, true, EndReason::WallClockExhausted) => Some("the policy's wall clock ran out".into()),
            (_, true, EndReason::Abandoned) => Some("the program made no call for too long".into()),
            (ProgramExit::Ended, false, _) => {
                let calls = match result.tool_calls {
                    0 => "without a call".into(),
                    1 => "after 1 call".into(),
                    calls => format!("after {calls} calls"),
                };
                let line = last_line(folder).map(|line| format!("; its last words: {line}"));
                let line = line.unwrap_or_default();
                Some(format!("the program ended {calls}, before its episode did ({status}){line}"))
            }
            (ProgramExit::Ended | ProgramExit::StillRunning, ..) => None,
        }
    }
}

/// The last line that a program has written to stderr, or else to stdout.
fn last_line(folder: &Path) -> Option<String> {
    [STDERR_FILE, STDOUT_FILE].into_iter().find_map(|name| {
        let bytes = fs::read(folder.join(name)).ok()?;
        let text = String::from_utf8_lossy(&bytes);
        let line = text.lines().map(str::trim).rfind(|line| !line.is_empty())?;
        Some(line.chars().take(LAST_LINE_CHARS).collect())
    })
}

/// Removes the result that an interrupted run has left.
fn remove_old_result(path: &Path) -> Result<(), PlayError> {
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
