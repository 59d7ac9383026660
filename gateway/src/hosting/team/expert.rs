//! The task's expert as the operator of one robot, beside people or programs who have the others. It plays its script for all robots,
//! of which its own does its part; the others' parts take as long as they do in the script, and are theirs to do. Where something is
//! not done by then, the script gives up, and begins again with what is as it is.

use std::{sync::Arc, thread, time::Duration};

use tandem_episodes::{
    EpisodeError, EpisodeSpec, Facts,
    players::{Episode, PlayerError, PrivilegedEpisode, PrivilegedPlayer, experts::Expert},
};
use tandem_tools_spec::{ActCall, Finish, MoveWrists, Note, ToolCall, ToolReply, Wait};
use tokio::runtime::Handle;

use super::{Team, round::Company};
use crate::hosting::{EpisodeThread, HostingError};

/// How often it is looked whether anybody is there again.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Control steps for which the robot stands before its script begins again.
const PAUSE_STEPS: u32 = 25;

/// One robot of an episode, as a script meets it that plays all of them.
struct OneRobot {
    team: Arc<Team>,
    episode: Arc<EpisodeThread>,
    seat: usize,
    robot: String,
    runtime: Handle,
}

impl Team {
    /// Has the expert of the task drive `robot` from now on, until the episode ends or everybody else has finished. It sees what no
    /// policy may know, which is recorded, and results name it. Asking again changes nothing.
    pub async fn take_expert(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        robot: &str,
    ) -> Result<(), HostingError> {
        let seat = self.seat(robot)?;
        let spec = episode.spec().clone();
        Expert::for_episode(&spec).map_err(HostingError::NoExpert)?;
        if std::mem::replace(&mut self.wheels().experts[seat], true) {
            return Ok(());
        }
        drop(episode.watch_driving(robot).await?);
        let text = format!("The task's expert drives robot {robot}.");
        episode.note(Some(robot), Note { text, ..Note::default() }).await?;
        let (team, episode, runtime) = (self.clone(), episode.clone(), Handle::current());
        let own = OneRobot { team, episode, seat, robot: robot.into(), runtime };
        let thread = thread::Builder::new().name(format!("expert of {robot}"));
        thread.spawn(move || own.play(&spec)).map_err(HostingError::Thread)?;
        Ok(())
    }
}

impl OneRobot {
    /// Plays until nobody does any more.
    fn play(mut self, spec: &EpisodeSpec) {
        while self.has_company() {
            let played = Expert::for_episode(spec).and_then(|mut expert| expert.play(&mut self));
            let paused = match played {
                Ok(()) | Err(PlayerError::GaveUp(_)) => {
                    self.call(Wait { steps: PAUSE_STEPS }.into()).map(drop)
                }
                Err(error) => Err(error),
            };
            match paused {
                Ok(()) => {}
                Err(PlayerError::EpisodeOver) => break,
                Err(error) => {
                    tracing::warn!(%error, robot = self.robot, "the expert of a robot has stopped");
                    break;
                }
            }
        }
        // Nobody waits for it any more. Of an episode that has ended, nobody is left who could be told.
        let _ = self.ask(Finish {}.into());
    }

    /// Waits until somebody is there, who does not let time pass while nobody is; false once all have finished, or it has ended.
    fn has_company(&self) -> bool {
        loop {
            let company = self.team.round().company(self.seat);
            match company {
                _ if self.episode.ended() => return false,
                Company::There => return true,
                Company::Gone => return false,
                Company::Away => thread::sleep(POLL_INTERVAL),
            }
        }
    }

    fn ask(&self, call: ToolCall) -> Result<ToolReply, HostingError> {
        let asked = self.team.call(&self.episode, &self.robot, call.into());
        Ok(self.runtime.block_on(asked)?.reply)
    }

    /// What of a command for all robots is for this one.
    fn own_part(&self, command: MoveWrists) -> ToolCall {
        let MoveWrists { steps, mut robots } = command;
        robots.retain(|entry| entry.robot == self.robot);
        match robots.is_empty() {
            true => Wait { steps }.into(),
            false => MoveWrists { steps, robots }.into(),
        }
    }
}

impl Episode for OneRobot {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        if !self.has_company() {
            return Err(PlayerError::EpisodeOver);
        }
        let tool = call.name();
        let own = match call {
            ToolCall::Act(ActCall::MoveWrists(command)) => self.own_part(command),
            other => other,
        };
        match self.ask(own) {
            Ok(reply) => Ok(reply),
            Err(HostingError::EpisodeStopped | HostingError::Episode(EpisodeError::Ended { .. })) => {
                Err(PlayerError::EpisodeOver)
            }
            Err(error) => Err(PlayerError::Call { tool, reason: error.to_string() }),
        }
    }
}

impl PrivilegedEpisode for OneRobot {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.episode.facts_blocking().map_err(|_| PlayerError::EpisodeOver)
    }
}
