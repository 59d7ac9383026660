//! Agents as programs: a new process for each episode, or for each of its robots.
//!
//! The environment of the process has the address of a server with that one episode. The process and its
//! children are stopped when the episode or its time limit ends.

mod kept_output;
mod participant;
mod process;

use std::{
    fs::{self, File},
    io::{self, Read, Seek, SeekFrom},
    path::Path,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use serde_json::{Value, json};
use tandem_episodes::{
    EpisodeError, EpisodeSpec, RunFolder, Visibility, create_private_folder, printable, write_result,
};
use tandem_evaluation::{
    policies::{EpisodeOutput, PlayError, PlayOutcome, Policy},
    results::PolicyCard,
};
use tandem_tools_spec::{Driving, EndReason, ModelEnding, ResultReply, StartReply, Usage};

use super::{lost, own_result, python::PythonModule, remove_old_result};
use crate::{
    hosting::{EpisodeThread, Guests, HostingError, Purpose, episode_name},
    http::Server,
    settings::{Layer, Record, Settings, SettingsError},
    token::Token,
};
use participant::Participant;
pub use process::end_all_programs;
use process::{ProcessGroup, ProcessGroups, STDERR_FILE, STDOUT_FILE};

/// Time for which a program may continue after its episode has ended.
const GRACE_PERIOD: Duration = Duration::from_secs(10);

/// Polling interval for the state of programs.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Maximum length of the quotation from a program's output in a result.
const QUOTED_CHARS: usize = 300;
const QUOTED_LINES: usize = 3;

/// Length of the end of the output file from which the quotation is taken.
const LAST_WORDS_BYTES: u64 = 64 << 10;

/// A command that plays episodes.
#[derive(Debug)]
pub struct Program {
    command: String,
    /// Name and card of the policy in results.
    name: String,
    card: Value,
    /// One process for all robots, or one per robot.
    driving: Driving,
    /// Maximum run time of one process.
    limit: Duration,
    settings: Arc<Settings>,
    processes: Arc<ProcessGroups>,
}

impl Program {
    /// Creates a policy that runs `command` in a shell. A signal that ends this process also ends the
    /// processes of the policy.
    pub fn new(command: String, driving: Driving, limit: Duration) -> Result<Program, SettingsError> {
        let flags = Layer {
            listen: Some(([127, 0, 0, 1], 0).into()),
            max_episodes: Some(1),
            // The program could read files, so no file is written within its reach while it runs.
            record: Some(Record::After),
            ..Layer::default()
        };
        let processes = Arc::new(ProcessGroups::default());
        process::end_with_all(&processes);
        let (name, card) = (format!("exec:{command}"), json!({ "command": command }));
        let settings = Settings::resolve(flags, None)?;
        Ok(Program { command, name, card, driving, limit, settings, processes })
    }

    /// Creates a policy that is a language model. Results contain its `name` and `card`.
    pub fn agent(
        agent: &PythonModule,
        name: String,
        card: Value,
        driving: Driving,
        limit: Duration,
    ) -> Result<Program, SettingsError> {
        Ok(Program { name, card, ..Program::new(agent.shell_line(), driving, limit)? })
    }

    /// Returns the settings of a server that hosts only this episode.
    fn settings_for(&self, spec: &EpisodeSpec, token: Token) -> Result<Arc<Settings>, PlayError> {
        Ok(Arc::new(Settings {
            token: Some(token),
            assistance: spec.assistance,
            disclosure: spec.disclosure,
            hints: spec.hints,
            base_limits: spec.locomotion.limits(&spec.robot).map_err(EpisodeError::from)?,
            robot: spec.robot.clone(),
            locomotion: spec.locomotion.clone(),
            sensing: spec.sensing,
            stress: spec.stress,
            renderer: spec.renderer,
            camera: spec.camera,
            ..(*self.settings).clone()
        }))
    }

    /// Starts a process for each participant, waits until all have ended, and returns the exit of each.
    fn run(
        &self,
        server: &Server,
        episode: &EpisodeThread,
        start: &StartReply,
        participants: &[Participant],
    ) -> Result<Vec<FoundProgram>, PlayError> {
        let url = format!("http://{}", server.address());
        let mut groups = Vec::new();
        for participant in participants {
            participant.write(start, &url, &self.driving)?;
        }
        for participant in participants {
            let environment = participant.environment(start, &url);
            let group =
                ProcessGroup::start(&self.processes, &self.command, &environment, participant.folder.path());
            groups.push(group.map_err(|error| lost("the program cannot be started", error))?);
        }
        let exits = self.watch(&mut groups, episode).map_err(|error| lost("the program is lost", error))?;
        let statuses: io::Result<Vec<String>> = groups.into_iter().map(ProcessGroup::stop).collect();
        let statuses = statuses.map_err(|error| lost("the program is lost", error))?;
        // With several programs, the caller is unknown.
        let refusal = episode.last_refusal().filter(|_| participants.len() == 1);
        let found = exits.into_iter().zip(statuses).map(|((exit, env_steps), status)| {
            let refusal = refusal.clone().filter(|_| exit == ProgramExit::Failed);
            FoundProgram { exit, env_steps, status, refusal }
        });
        Ok(found.collect())
    }

    /// Waits until all programs have ended, one of them has failed, or their time limit is over. Returns the
    /// exit of each program with its control step.
    fn watch(
        &self,
        groups: &mut [ProcessGroup],
        episode: &EpisodeThread,
    ) -> io::Result<Vec<(ProgramExit, u32)>> {
        let began = Instant::now();
        let mut over: Option<Instant> = None;
        let mut exits: Vec<Option<(ProgramExit, u32)>> = groups.iter().map(|_| None).collect();
        loop {
            for (exit, group) in exits.iter_mut().zip(groups.iter_mut()) {
                if exit.is_none()
                    && let Some(well) = group.ended_well()?
                {
                    // If a program has ended while the episode still runs, the program ended first.
                    let found = match (episode.ended(), well) {
                        (true, _) => ProgramExit::After,
                        (false, true) => ProgramExit::Left,
                        (false, false) => ProgramExit::Failed,
                    };
                    *exit = Some((found, episode.env_steps()));
                }
            }
            let late = began.elapsed() >= self.limit;
            let stay = episode.ended() && over.get_or_insert_with(Instant::now).elapsed() >= GRACE_PERIOD;
            let failed = exits.iter().flatten().any(|(exit, _)| exit.is_failure());
            let done = failed || exits.iter().all(Option::is_some);
            if late || stay || done {
                let running = match late && !episode.ended() {
                    true => ProgramExit::TimedOut,
                    false => ProgramExit::StillRunning,
                };
                let env_steps = episode.env_steps();
                let found: Vec<(ProgramExit, u32)> =
                    exits.into_iter().map(|exit| exit.unwrap_or((running, env_steps))).collect();
                // A program that exited normally had done its part if the other programs completed the
                // episode, or if another program caused its end.
                let excused = episode.ended() || found.iter().any(|(exit, _)| exit.is_failure());
                let judged = found.into_iter().map(|(exit, env_steps)| match exit {
                    ProgramExit::Left if excused => (ProgramExit::After, env_steps),
                    exit => (exit, env_steps),
                });
                return Ok(judged.collect());
            }
            thread::sleep(POLL_INTERVAL);
        }
    }

    /// Returns the report on a program that left its episode early, with its last output.
    fn last_words(&self, found: &FoundProgram, so_far: &str, folder: &Path) -> Option<String> {
        let FoundProgram { exit, status, refusal, .. } = found;
        match exit {
            ProgramExit::Left | ProgramExit::Failed => {
                let refusal = refusal.as_ref().map(|why| format!("; the last call that was refused: {why}"));
                let refusal = refusal.unwrap_or_default();
                let words = last_lines(folder).map(|lines| format!("; its last words: {lines}"));
                let words = words.unwrap_or_default();
                Some(format!("the program ended {so_far}, before its episode did ({status}){refusal}{words}"))
            }
            ProgramExit::TimedOut => Some(format!(
                "the program was stopped {so_far}, when its {} s were over",
                self.limit.as_secs_f64()
            )),
            ProgramExit::After | ProgramExit::StillRunning => None,
        }
    }

    /// Returns the outcome of the episode with `result`, given the exits of its programs in `ran`.
    fn outcome(
        &self,
        result: ResultReply,
        thought: Duration,
        ran: &[FoundProgram],
        participants: &[Participant],
    ) -> Result<PlayOutcome, PlayError> {
        let told = ran.iter().zip(participants).filter_map(|(found, participant)| {
            let so_far = match (result.tool_calls, participants) {
                (0, _) => "without a call".into(),
                (1, [_]) => "after 1 call".into(),
                (calls, [_]) => format!("after {calls} calls"),
                (_, _) => format!("at control step {}", found.env_steps),
            };
            let words = self.last_words(found, &so_far, participant.folder.path())?;
            Some(participant.robot.map_or(words.clone(), |robot| format!("{robot}: {words}")))
        });
        let mut reasons: Vec<String> = told.collect();
        reasons.extend(result.usage.iter().flat_map(Usage::own_endings).map(told_ending));
        match result.ended {
            EndReason::WallClockExhausted => reasons.push("the policy's wall clock ran out".into()),
            EndReason::Abandoned => reasons.push("the program made no call for too long".into()),
            EndReason::TaskComplete
            | EndReason::StepBudgetExhausted
            | EndReason::Finished
            | EndReason::PolicyFailed
            | EndReason::SimulatorFailed => {}
        }
        let stopped = (!reasons.is_empty()).then(|| reasons.join("; "));
        if result.tool_calls == 0 {
            return Err(PlayError::NotReady(stopped.unwrap_or_else(|| "the program made no call".into())));
        }
        // A hanging program counts as failed.
        let ended = match result.ended {
            EndReason::Abandoned => EndReason::PolicyFailed,
            ended => ended,
        };
        Ok(PlayOutcome { result: ResultReply { ended, ..result }, thought, stopped })
    }
}

impl Policy for Program {
    fn card(&self) -> PolicyCard {
        let (mut name, mut settings) = (self.name.clone(), self.card.clone());
        settings["limit_s"] = self.limit.as_secs_f64().into();
        if self.driving.is_per_robot() {
            name.push_str(" per robot");
            settings["patience_s"] = self.driving.patience_s().into();
            settings["talk"] = (self.driving.talk == Some(true)).into();
        }
        PolicyCard { settings: Some(settings), ..name.as_str().into() }
    }

    fn play_episode(&self, spec: &EpisodeSpec, place: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        let folder = place.folder;
        create_own_folder(folder).map_err(|error| lost("no folder for the episode", error))?;
        let absolute = folder.canonicalize().map_err(|error| lost("no folder for the episode", error))?;
        remove_old_result(&absolute.join(tandem_episodes::RESULT_FILE))?;
        let (token, text) = Token::random().map_err(HostingError::from)?;
        let guests = Guests { purpose: Purpose::Evaluation, ..Guests::default() };
        let server = Server::start_for(self.settings_for(spec, token)?, guests);
        let server = server.map_err(|error| lost("no server", error))?;
        let id = episode_name(spec).map_err(HostingError::from)?;
        let files =
            RunFolder { path: absolute.clone(), visibility: Visibility::After, pages: true, live: None };
        let (episode, start) = server.host(&id, spec.clone(), &self.driving, files)?;
        if let Some(reason) = start.briefing.recording_failed {
            return Err(PlayError::Lost(reason));
        }
        let participants = Participant::all(&start, &text)?;
        let ran = self.run(&server, &episode, &start, &participants);
        if ran.as_ref().is_ok_and(|ran| ran.iter().any(|found| found.exit.is_failure())) {
            episode.end_blocking(EndReason::PolicyFailed);
        }
        let thought = episode.thought();
        server.stop();
        for participant in &participants {
            participant.keep_files(&absolute).map_err(|error| lost("a program's files are lost", error))?;
        }
        let result = own_result(&episode)?;
        // A program that has found the folder may have written there.
        write_result(&result, &absolute).map_err(EpisodeError::from)?;
        self.outcome(result, thought, &ran?, &participants)
    }
}

/// Creates the folder of an episode. Refuses a link, because its creator would choose the files that are
/// written.
fn create_own_folder(folder: &Path) -> io::Result<()> {
    let is_link = fs::symlink_metadata(folder).is_ok_and(|found| found.is_symlink());
    if is_link {
        let why = format!("{} is a link; remove it, or give another --out", folder.display());
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, why));
    }
    create_private_folder(folder)
}

/// Describes the end of a model's play and quotes its final text.
fn told_ending(ended: &ModelEnding) -> String {
    let text: String = ended.text.chars().take(QUOTED_CHARS).collect();
    match text.is_empty() {
        true => ended.words(),
        false => format!("{}: {text}", ended.words()),
    }
}

/// State of a program at the end of the wait.
struct FoundProgram {
    exit: ProgramExit,
    /// Number of control steps of the episode at that time.
    env_steps: u32,
    /// Exit status as text.
    status: String,
    /// Reason for the program's last refusal, if the program has failed.
    refusal: Option<String>,
}

/// State of a program's process at the end of the wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ProgramExit {
    /// The program ended after its episode, or had completed its part and did not cause the end.
    After,
    /// The program ended with status 0 before its episode ended.
    Left,
    /// The program failed to start, crashed or was killed before its episode ended.
    Failed,
    /// The program still runs, although its episode is over or another program has failed.
    StillRunning,
    /// The program exceeded its time limit.
    TimedOut,
}

impl ProgramExit {
    fn is_failure(self) -> bool {
        match self {
            ProgramExit::Failed | ProgramExit::TimedOut => true,
            ProgramExit::After | ProgramExit::Left | ProgramExit::StillRunning => false,
        }
    }
}

/// Returns the last lines that a program has written to stderr, or else to stdout, as many as fit.
fn last_lines(folder: &Path) -> Option<String> {
    [STDERR_FILE, STDOUT_FILE].into_iter().find_map(|name| {
        let path = folder.join(name);
        // A program may have replaced the file by a link.
        fs::symlink_metadata(&path).ok().filter(|found| found.is_file())?;
        let mut file = File::open(path).ok()?;
        let read_from = file.metadata().ok()?.len().saturating_sub(LAST_WORDS_BYTES);
        file.seek(SeekFrom::Start(read_from)).ok()?;
        let mut bytes = Vec::new();
        // The program may still be writing.
        file.take(LAST_WORDS_BYTES).read_to_end(&mut bytes).ok()?;
        let text = String::from_utf8_lossy(&bytes);
        // Python underlines errors with lines that contain no letters.
        let worded = text.lines().map(str::trim).filter(|line| line.contains(char::is_alphanumeric));
        let mut lines = worded.rev();
        let mut quoted: String = lines.next()?.chars().take(QUOTED_CHARS).collect();
        for line in lines.take(QUOTED_LINES - 1) {
            let longer = format!("{line} / {quoted}");
            if longer.chars().count() > QUOTED_CHARS {
                break;
            }
            quoted = longer;
        }
        Some(printable(&quoted))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_words_end_with_the_last_line() {
        let folder = tempfile::tempdir().unwrap();
        let said = |stdout: &str, stderr: &str| {
            fs::write(folder.path().join(STDOUT_FILE), stdout).unwrap();
            fs::write(folder.path().join(STDERR_FILE), stderr).unwrap();
            last_lines(folder.path())
        };
        let traceback =
            "Traceback:\n  File \"agent.py\", line 7\n    plan()\n    ~~~~^^\nRuntimeError: no plan\n\n";
        let told = "File \"agent.py\", line 7 / plan() / RuntimeError: no plan";
        assert_eq!(said("unheard", traceback).as_deref(), Some(told));
        assert_eq!(said("only this\n", " \n").as_deref(), Some("only this"));
        let long = "x".repeat(1000);
        assert_eq!(said("", &format!("before\n{long}")).map(|words| words.len()), Some(QUOTED_CHARS));
        assert_eq!(said("", &format!("{long}\nthe end")).as_deref(), Some("the end"));
        assert_eq!(said("", ""), None);
        let much = "x y\n".repeat(LAST_WORDS_BYTES as usize);
        assert_eq!(said("", &format!("{much}{traceback}")).as_deref(), Some(told));
        let earlier = format!("long ago\n{}", "\n".repeat(LAST_WORDS_BYTES as usize));
        assert_eq!(said("heard", &earlier).as_deref(), Some("heard"), "all of a file is not read");
    }
}
