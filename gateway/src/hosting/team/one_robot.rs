//! One robot of an episode whose others are driven by somebody else, as it is met by who plays all of them: of what they are told, its own
//! does its part; the others' parts take as long as they do in that play, and are theirs to do.

use std::{sync::Arc, thread, time::Duration};

use tandem_episodes::{
    EpisodeError, Facts, Picture, TeamObservation,
    players::{Episode, LocalEpisode, PlayerError, PrivilegedEpisode},
};
use tandem_tools_spec::{
    ActCall, ExtraInformation, MoveWrists, Observe, SendJointChunk, Tool as _, ToolCall, ToolReply, Wait,
};
use tokio::runtime::Handle;

use super::{Team, round::Company};
use crate::hosting::{EpisodeThread, HostingError};

/// How often it is looked whether anybody is there again.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// The robot.
pub struct OneRobot {
    pub team: Arc<Team>,
    pub episode: Arc<EpisodeThread>,
    pub seat: usize,
    pub robot: String,
    pub runtime: Handle,
}

impl OneRobot {
    /// Waits until somebody is there, who does not let time pass while nobody is; false once all have finished, or it has ended.
    pub fn has_company(&self) -> bool {
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

    /// What a call of the robot's operator is answered with. One that has kept the others waiting for too long is told so once; who plays
    /// here has no use for that, and commands all the same.
    pub fn ask(&self, call: ToolCall) -> Result<ToolReply, HostingError> {
        let ask = || -> Result<ToolReply, HostingError> {
            let asked = self.team.call(&self.episode, &self.robot, call.clone().into(), None);
            Ok(self.runtime.block_on(asked)?.reply)
        };
        match ask() {
            Err(HostingError::LateCommand { .. }) => ask(),
            answer => answer,
        }
    }

    fn check_company(&self) -> Result<(), PlayerError> {
        if self.has_company() { Ok(()) } else { Err(PlayerError::EpisodeOver) }
    }

    /// What of a command for all robots is for this one.
    fn own_part(&self, call: ToolCall) -> ToolCall {
        match call {
            ToolCall::Act(ActCall::MoveWrists(MoveWrists { steps, mut robots })) => {
                robots.retain(|entry| entry.robot == self.robot);
                match robots.is_empty() {
                    true => Wait { steps }.into(),
                    false => MoveWrists { steps, robots }.into(),
                }
            }
            ToolCall::Act(ActCall::SendJointChunk(SendJointChunk { mut robots })) => {
                robots.retain(|chunk| chunk.robot == self.robot);
                SendJointChunk { robots }.into()
            }
            other => other,
        }
    }
}

/// What a refusal is to a player.
fn refused(tool: &'static str, error: HostingError) -> PlayerError {
    match error {
        HostingError::EpisodeStopped | HostingError::Episode(EpisodeError::Ended { .. }) => {
            PlayerError::EpisodeOver
        }
        error => PlayerError::Call { tool, reason: error.to_string() },
    }
}

impl Episode for OneRobot {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        self.check_company()?;
        let tool = call.name();
        self.ask(self.own_part(call)).map_err(|error| refused(tool, error))
    }
}

impl PrivilegedEpisode for OneRobot {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.episode.facts_blocking().map_err(|_| PlayerError::EpisodeOver)
    }
}

impl LocalEpisode for OneRobot {
    fn observe(
        &mut self,
        observe: &Observe,
        shown: &[ExtraInformation],
    ) -> Result<TeamObservation, PlayerError> {
        self.check_company()?;
        let seen =
            self.episode.look_blocking(observe, shown).map_err(|error| refused(Observe::NAME, error))?;
        self.team.round().has_looked(self.seat);
        Ok(seen)
    }

    fn carry_out(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        self.call(call)
    }

    fn third_person(&mut self) -> Result<Picture, PlayerError> {
        self.episode.room_blocking().map_err(|error| refused(Observe::NAME, error))
    }
}
