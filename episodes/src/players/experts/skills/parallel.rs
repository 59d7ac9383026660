//! Scripts that are played at the same time. Each has its own robots, and their commands are merged into one.

use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use tandem_tools_spec::{ActCall, MoveWrists, ToolCall, ToolReply};

use super::commander::{BEAT_STEPS, Commander};
use crate::players::{Episode, PlayerError, PrivilegedEpisode};
use crate::scoring::Facts;

/// Script of some of the robots, while the other robots play other scripts.
pub struct ParallelScript<'a> {
    pub robots: &'a [usize],
    pub script: BoxedScript<'a>,
}

type BoxedScript<'a> = Box<dyn FnOnce(&mut Commander) -> Result<(), PlayerError> + Send + 'a>;

/// Outcome that a script receives once its command has been executed.
struct CommandOutcome {
    reply: ToolReply,
    facts: Facts,
}

/// The episode as one of the scripts sees it.
struct ScriptEpisode {
    facts: Facts,
    commands: Sender<MoveWrists>,
    outcomes: Receiver<CommandOutcome>,
}

impl Episode for ScriptEpisode {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let tool = call.name();
        let ToolCall::Act(ActCall::MoveWrists(command)) = call else {
            return Err(PlayerError::Call { tool, reason: "not while others play".into() });
        };
        // The channel is closed once the other scripts have stopped; they report the reason themselves.
        self.commands.send(command).map_err(|_| PlayerError::EpisodeOver)?;
        let CommandOutcome { reply, facts } = self.outcomes.recv().map_err(|_| PlayerError::EpisodeOver)?;
        self.facts = facts;
        Ok(reply)
    }
}

impl PrivilegedEpisode for ScriptEpisode {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        Ok(self.facts.clone())
    }
}

/// The other end of a [`ScriptEpisode`].
struct ScriptChannel {
    commands: Receiver<MoveWrists>,
    outcomes: Sender<CommandOutcome>,
}

/// Runs all scripts to their ends. Nothing moves before every running script has sent its next command. The
/// outcome therefore does not depend on the threads' timing.
pub fn in_parallel(commander: &mut Commander, scripts: Vec<ParallelScript>) -> Result<(), PlayerError> {
    let facts = commander.facts()?;
    thread::scope(|scope| {
        let mut channels = Vec::with_capacity(scripts.len());
        let mut players = Vec::with_capacity(scripts.len());
        for (index, ParallelScript { robots, script }) in scripts.into_iter().enumerate() {
            let (commands, commanded) = channel();
            let (outcomes, heard) = channel();
            channels.push(ScriptChannel { commands: commanded, outcomes });
            let mut episode = ScriptEpisode { facts: facts.clone(), commands, outcomes: heard };
            let (task, targets) = (commander.task(), commander.targets().to_vec());
            let variety = commander.variety().map(|variety| variety.of_script(index));
            players.push(scope.spawn(move || {
                let mut commander = Commander::in_step(task, targets, &mut episode).varied(variety);
                let outcome = script(&mut commander);
                (robots, commander.targets().to_vec(), outcome)
            }));
        }
        let merged = merge_commands(commander, channels);
        let mut failed = None;
        for player in players {
            let (robots, targets, outcome) = player.join().unwrap_or_else(|panic| resume_unwind(panic));
            commander.take_over(robots, &targets);
            failed = failed.or(outcome.err().filter(|error| !matches!(error, PlayerError::EpisodeOver)));
        }
        merged.and(failed.map_or(Ok(()), Err))
    })
}

/// Merges the commands of all scripts into one call at a time, until no script sends any more.
fn merge_commands(commander: &mut Commander, mut channels: Vec<ScriptChannel>) -> Result<(), PlayerError> {
    loop {
        let mut robots = Vec::new();
        channels.retain(|channel| match channel.commands.recv() {
            Ok(command) => {
                robots.extend(command.robots);
                true
            }
            Err(_) => false,
        });
        if channels.is_empty() {
            return Ok(());
        }
        let reply = commander.pass_on(MoveWrists { steps: BEAT_STEPS, robots })?;
        let facts = commander.facts()?;
        for channel in &channels {
            // A script that has ended receives no outcome.
            let _ = channel.outcomes.send(CommandOutcome { reply: reply.clone(), facts: facts.clone() });
        }
    }
}
