//! Scripts that are played at once, each by robots of its own: their commands go out as one.

use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use tandem_tools_spec::{ActCall, MoveWrists, ToolCall, ToolReply};

use super::stage::{BEAT_STEPS, Stage};
use crate::players::{Backstage, Caller, PlayerError};
use crate::scoring::Facts;

/// What some of the robots do while others do something else.
pub struct Part<'a> {
    pub robots: &'a [usize],
    pub script: Script<'a>,
}

type Script<'a> = Box<dyn FnOnce(&mut Stage) -> Result<(), PlayerError> + Send + 'a>;

/// What a part hears once its command has been executed.
struct Answer {
    reply: ToolReply,
    facts: Facts,
}

/// The episode as one part meets it.
struct Share {
    facts: Facts,
    commands: Sender<MoveWrists>,
    answers: Receiver<Answer>,
}

impl Caller for Share {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let tool = call.name();
        let ToolCall::Act(ActCall::MoveWrists(command)) = call else {
            return Err(PlayerError::Call { tool, reason: "not while others play".into() });
        };
        // The others have stopped with what they told the conductor.
        self.commands.send(command).map_err(|_| PlayerError::EpisodeOver)?;
        let Answer { reply, facts } = self.answers.recv().map_err(|_| PlayerError::EpisodeOver)?;
        self.facts = facts;
        Ok(reply)
    }
}

impl Backstage for Share {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        Ok(self.facts.clone())
    }
}

/// The other end of a [`Share`].
struct Line {
    commands: Receiver<MoveWrists>,
    answers: Sender<Answer>,
}

/// Plays all parts to their ends. Nothing moves before every part that still plays has said what its robots do next, so that equal
/// beginnings have equal ends, whichever thread is faster.
pub fn at_once(stage: &mut Stage, parts: Vec<Part>) -> Result<(), PlayerError> {
    let facts = stage.facts()?;
    thread::scope(|scope| {
        let mut lines = Vec::with_capacity(parts.len());
        let mut players = Vec::with_capacity(parts.len());
        for Part { robots, script } in parts {
            let (commands, commanded) = channel();
            let (answers, answered) = channel();
            lines.push(Line { commands: commanded, answers });
            let mut share = Share { facts: facts.clone(), commands, answers: answered };
            let (task, told) = (stage.task(), stage.told().to_vec());
            players.push(scope.spawn(move || {
                let mut stage = Stage::in_step(task, told, &mut share);
                let outcome = script(&mut stage);
                (robots, stage.told().to_vec(), outcome)
            }));
        }
        let conducted = conduct(stage, lines);
        let mut failed = None;
        for player in players {
            let (robots, told, outcome) = player.join().unwrap_or_else(|panic| resume_unwind(panic));
            stage.take_over(robots, &told);
            failed = failed.or(outcome.err().filter(|error| !matches!(error, PlayerError::EpisodeOver)));
        }
        conducted.and(failed.map_or(Ok(()), Err))
    })
}

/// Makes one call of the commands of all parts, until none has any more.
fn conduct(stage: &mut Stage, mut lines: Vec<Line>) -> Result<(), PlayerError> {
    loop {
        let mut robots = Vec::new();
        lines.retain(|line| match line.commands.recv() {
            Ok(command) => {
                robots.extend(command.robots);
                true
            }
            Err(_) => false,
        });
        if lines.is_empty() {
            return Ok(());
        }
        let reply = stage.pass_on(MoveWrists { steps: BEAT_STEPS, robots })?;
        let facts = stage.facts()?;
        for line in &lines {
            // A part that has gone does not play on.
            let _ = line.answers.send(Answer { reply: reply.clone(), facts: facts.clone() });
        }
    }
}
