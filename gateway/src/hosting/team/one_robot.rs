//! Adapter through which a player written for all robots drives one robot, while other operators drive the
//! rest.
//!
//! Only this robot's part of each command is executed. The command keeps its duration; the other robots
//! execute the commands of their own operators.

use std::{thread, time::Duration};

use tandem_episodes::{
    EpisodeError, Facts, Picture, TeamObservation,
    players::{Episode, LocalEpisode, PlayerError, PrivilegedEpisode},
};
use tandem_tools_spec::{
    ActCall, ExtraInformation, MoveWrists, Observe, SendJointChunk, SendJointDrives, Tool as _, ToolCall,
    ToolReply, Wait,
};
use tokio::runtime::Handle;

use super::{
    handle::OperatorHandle,
    round::{Operator, Others},
};
use crate::hosting::HostingError;

/// Interval at which `wait_for_others` polls the other operators.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// Robot driven by a player that is written for all robots.
pub struct OneRobot {
    pub operator: OperatorHandle,
    pub runtime: Handle,
}

impl OneRobot {
    /// Waits until another operator plays, because time must not pass without other players. Returns false
    /// once all other operators have finished or the episode has ended.
    pub fn wait_for_others(&self) -> bool {
        loop {
            let others = self.operator.round().state_of_others(self.operator.seat);
            match others {
                _ if self.operator.episode.ended() => return false,
                Others::There => return true,
                Others::Gone => return false,
                Others::Away => thread::sleep(POLL_INTERVAL),
            }
        }
    }

    /// Answers a call of the robot's operator. Repeats the call after a first [`HostingError::LateCommand`],
    /// because this player does not need the notice.
    pub fn ask(&self, call: ToolCall) -> Result<ToolReply, HostingError> {
        let ask = || -> Result<ToolReply, HostingError> {
            Ok(self.runtime.block_on(self.operator.call(call.clone().into(), None))?.reply)
        };
        match ask() {
            Err(HostingError::LateCommand { .. }) => ask(),
            answer => answer,
        }
    }

    fn check_others(&self) -> Result<(), PlayerError> {
        if self.wait_for_others() { Ok(()) } else { Err(PlayerError::EpisodeOver) }
    }

    /// Extracts this robot's part of a command for all robots.
    fn own_part(&self, call: ToolCall) -> ToolCall {
        let own = self.operator.robot();
        match call {
            ToolCall::Act(ActCall::MoveWrists(MoveWrists { steps, mut robots })) => {
                robots.retain(|entry| entry.robot == own);
                match robots.is_empty() {
                    true => Wait { steps }.into(),
                    false => MoveWrists { steps, robots }.into(),
                }
            }
            ToolCall::Act(ActCall::SendJointChunk(SendJointChunk { mut robots })) => {
                robots.retain(|chunk| chunk.robot == own);
                SendJointChunk { robots }.into()
            }
            ToolCall::Act(ActCall::SendJointDrives(SendJointDrives { mut robots })) => {
                robots.retain(|drives| drives.robot == own);
                SendJointDrives { robots }.into()
            }
            other => other,
        }
    }
}

/// Converts a refusal into a player's error.
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
        self.check_others()?;
        let tool = call.name();
        self.ask(self.own_part(call)).map_err(|error| refused(tool, error))
    }
}

impl PrivilegedEpisode for OneRobot {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.operator.episode.facts_blocking().map_err(|_| PlayerError::EpisodeOver)
    }
}

impl LocalEpisode for OneRobot {
    fn observe(
        &mut self,
        observe: &Observe,
        shown: &[ExtraInformation],
    ) -> Result<TeamObservation, PlayerError> {
        self.check_others()?;
        let seen = self
            .operator
            .episode
            .look_blocking(observe, shown)
            .map_err(|error| refused(Observe::NAME, error))?;
        self.operator.own(Operator::has_looked);
        Ok(seen)
    }

    fn carry_out(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        self.call(call)
    }

    fn third_person(&mut self) -> Result<Picture, PlayerError> {
        self.operator.episode.room_blocking().map_err(|error| refused(Observe::NAME, error))
    }
}
