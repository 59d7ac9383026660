//! The operators of an episode in which each robot has one.
//!
//! A step is executed once every operator has commanded, or once the time limit for missing commands (the
//! patience) is over. Robots of silent operators then hold still, and nobody waits for these operators until
//! they call again. All commands end with the shortest one. Each operator has a separate clock. An operator's
//! call blocks until the reply for its robot is ready.

mod clock;
mod collection;
mod driving;
mod handle;
mod one_robot;
mod partner;
mod planning;
mod round;
mod rules;
mod setpoint;

use std::{
    sync::{Mutex, MutexGuard},
    time::Duration,
};

use tandem_episodes::EpisodeError;
use tandem_tools_spec::{Call, Driving, OperatorToken};
use tokio::sync::{Semaphore, SemaphorePermit};

use super::{HostingError, episode::WAITING_CALLS};
use crate::token::Token;
pub use collection::{CollectedEpisode, Collection, CollectionProgress, CollectionStage};
pub use driving::Driver;
pub use handle::OperatorHandle;
pub use partner::seat_again;
pub use round::OperatorMemory;
use round::Round;
pub use rules::TeamRules;
pub use setpoint::{DriverRequest, Setpoint};

/// The operators of one episode.
#[derive(Debug)]
pub struct Team {
    seats: Vec<Seat>,
    patience: Duration,
    talk: bool,
    rules: TeamRules,
    round: Mutex<Round>,
}

/// Seat of the operator of one robot.
#[derive(Debug)]
struct Seat {
    robot: String,
    token: Token,
    /// Permits for calls that wait for the episode. Each operator has an equal share, so that operators do
    /// not block each other.
    places: Semaphore,
}

/// Returns the number of waiting calls allowed for each of `operators` operators.
fn own_calls(operators: usize) -> usize {
    (WAITING_CALLS / operators.max(1)).max(1)
}

impl Team {
    /// Creates an operator for each of `robots` and returns their tokens. An operator with a seat in a
    /// collection keeps that seat's token.
    pub fn new<'a>(
        robots: impl Iterator<Item = &'a str>,
        driving: &Driving,
        collection: Option<&Collection>,
        rules: TeamRules,
    ) -> Result<(Team, Vec<OperatorToken>), HostingError> {
        let mut tokens = Vec::new();
        for robot in robots {
            let kept = collection.and_then(|collection| collection.seat(robot));
            let (_, token) = kept.map_or_else(Token::random, Ok)?;
            tokens.push(OperatorToken { robot: robot.into(), token });
        }
        Ok((Team::of(&tokens, driving, rules)?, tokens))
    }

    /// Creates the team of a restored episode, whose operators have these tokens.
    pub fn of(tokens: &[OperatorToken], driving: &Driving, rules: TeamRules) -> Result<Team, HostingError> {
        let mut seats = Vec::new();
        for OperatorToken { robot, token } in tokens {
            let token = Token::parse(token, "an operator")?;
            seats.push(Seat { robot: robot.clone(), token, places: Semaphore::new(own_calls(tokens.len())) });
        }
        let round = Mutex::new(Round::new(seats.iter().map(|seat| seat.robot.as_str())));
        let patience = Duration::from_secs_f64(driving.patience_s());
        Ok(Team { seats, patience, talk: driving.talk == Some(true), rules, round })
    }

    /// Returns the robot whose operator has the token `text`. Compares every token, so that the time taken
    /// does not reveal the match.
    pub fn robot_of(&self, text: &str) -> Option<&str> {
        let mut robot = None;
        for seat in &self.seats {
            if seat.token.matches(text) {
                robot = Some(seat.robot.as_str());
            }
        }
        robot
    }

    /// Acquires a permit of the operator of `robot` for a call that waits for the episode.
    pub fn take_place(&self, robot: &str) -> Result<SemaphorePermit<'_>, HostingError> {
        let seat = &self.seats[self.seat(robot)?];
        let limit = own_calls(self.seats.len());
        seat.places.try_acquire().map_err(|_| HostingError::TooManyWaiting { limit })
    }

    /// Returns the part of the operators' state that a suspended episode keeps.
    pub fn memory(&self) -> Vec<OperatorMemory> {
        self.round().memory()
    }

    /// Restores the operators' state from `memory`.
    pub fn restore(&self, memory: Vec<OperatorMemory>) {
        self.round().restore(memory);
    }

    /// Returns true if a partner or a real-time driver has a robot, or if a command waits for execution.
    pub fn is_busy(&self) -> bool {
        self.round().is_busy()
    }

    /// Returns true if operators may send messages to each other.
    pub fn may_talk(&self) -> bool {
        self.talk
    }

    /// Drops the pending commands; the operators that wait for them receive an error.
    pub fn stop(&self) {
        // Dropping a command closes the channel of its reply.
        drop(self.round().begin());
    }

    /// Returns true while a partner of the previous server still has to be restored.
    pub fn misses_partners(&self) -> bool {
        self.round().operators.iter().any(|operator| operator.left.is_some())
    }

    /// Returns an error if the call names an unknown robot.
    fn check_robots(&self, call: &Call) -> Result<(), EpisodeError> {
        let is_known = |robot: &str| self.seats.iter().any(|seat| seat.robot == robot);
        call.robots()
            .into_iter()
            .find(|robot| !is_known(robot))
            .map_or(Ok(()), |robot| Err(self.unknown(robot)))
    }

    fn unknown(&self, robot: &str) -> EpisodeError {
        let have = self.seats.iter().map(|seat| seat.robot.clone()).collect();
        EpisodeError::UnknownRobot { name: robot.into(), have }
    }

    fn seat(&self, robot: &str) -> Result<usize, HostingError> {
        let found = self.seats.iter().position(|seat| seat.robot == robot);
        found.ok_or_else(|| self.unknown(robot).into())
    }

    fn round(&self) -> MutexGuard<'_, Round> {
        // Nothing panics while it holds the lock.
        self.round.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operator_takes_no_place_of_another() {
        let (team, _) =
            Team::new(["A", "B"].into_iter(), &Driving::default(), None, TeamRules::default()).unwrap();
        let taken: Vec<_> = (0..WAITING_CALLS / 2).map(|_| team.take_place("A").unwrap()).collect();
        let refused = team.take_place("A").unwrap_err();
        assert!(matches!(refused, HostingError::TooManyWaiting { limit: 8 }), "{refused}");
        drop(team.take_place("B").unwrap());
        drop(taken);
        drop(team.take_place("A").unwrap());
    }
}
