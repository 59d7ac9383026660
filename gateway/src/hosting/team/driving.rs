//! Real-time control by people, and by programs that use the same protocol as the page for people.
//!
//! A page sends up to 50 setpoints a second for its robot's wrists, fingers and base; a program may send
//! joint targets or setpoints of motors. In every control step, the latest setpoint becomes a one-step
//! command of the robot's operator, which goes through the team's rounds like any other command. The world
//! therefore runs no faster than real time, and pauses while a person is away.
//!
//! A recording of such an episode replays bit for bit. The wall clock only decides, before a call is made,
//! which setpoint becomes a command. The session sees whole control steps in the order of its calls. The
//! recording holds each call with exact numbers, and replay makes the same calls again. Setpoints that were
//! never commanded leave no trace in the world or the log.

use std::time::Instant;

use tandem_tools_spec::{Call, GetRobotState, ToolCall};
use tokio::{
    sync::mpsc,
    time::{MissedTickBehavior, interval},
};

use super::{
    handle::OperatorHandle,
    setpoint::{AWAY_AFTER, DriverRequest, Setpoint, TICK, Teleoperation},
};
use crate::hosting::{Answer, HostingError};

/// Maximum number of answers queued for a page.
const KEPT_ANSWERS: usize = 64;

/// A person's real-time control of robots. Dropping the value releases the robots.
#[derive(Debug)]
pub struct Driver {
    /// Operators of the person's robot, which is the first, and of the robots that this person makes hold
    /// still.
    operators: Vec<OperatorHandle>,
    number: u64,
}

impl Driver {
    /// Takes control of `robots` in the episode of `operator`. The person drives the first robot; the others
    /// hold still.
    ///
    /// Earlier drivers of these robots lose control, because the same person may have reloaded the page. The
    /// returned receiver gets the answers to the commands.
    pub fn take(
        operator: &OperatorHandle,
        robots: &[String],
    ) -> Result<(Driver, mpsc::Receiver<Result<Answer, HostingError>>), HostingError> {
        let beside = |robot: &String| OperatorHandle::new(&operator.team, &operator.episode, robot);
        let operators = robots.iter().map(beside).collect::<Result<Vec<OperatorHandle>, _>>()?;
        let (sender, answers) = mpsc::channel(KEPT_ANSWERS);
        let mut round = operator.round();
        round.drivers += 1;
        let number = round.drivers;
        for OperatorHandle { seat, .. } in &operators {
            let own = &mut round.operators[*seat];
            own.set_pace(TICK);
            own.teleoperation = Some(Teleoperation::new(number, &own.robot, sender.clone()));
        }
        if !std::mem::replace(&mut round.turning, true) {
            tokio::spawn(turn(operator.clone()));
        }
        drop(round);
        Ok((Driver { operators, number }, answers))
    }

    /// Sets the person's request for the first robot. The other robots hold still, and time passes for them,
    /// too.
    pub fn say(&self, request: &DriverRequest) {
        self.each(|place, own| {
            if let Some(teleoperation) = own.as_mut().filter(|own| own.driver == self.number) {
                teleoperation.pass_time(request);
                if place == 0 {
                    teleoperation.set(request);
                }
            }
        });
    }

    /// Returns the robots that the person waits for, once the person's command has been pending for longer
    /// than `AWAY_AFTER`. The list is empty before.
    pub fn waits_for(&self) -> Vec<String> {
        let Some(OperatorHandle { team, seat, .. }) = self.operators.first() else { return Vec::new() };
        let round = team.round();
        match round.operators[*seat].under_way.is_some_and(|since| since.elapsed() > AWAY_AFTER) {
            true => round.awaited(),
            false => Vec::new(),
        }
    }

    /// Calls `change` with the index and the driving state of each of the robots; the person drives the
    /// first.
    fn each(&self, mut change: impl FnMut(usize, &mut Option<Teleoperation>)) {
        let Some(OperatorHandle { team, .. }) = self.operators.first() else { return };
        let mut round = team.round();
        for (place, OperatorHandle { seat, .. }) in self.operators.iter().enumerate() {
            change(place, &mut round.operators[*seat].teleoperation);
        }
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        self.each(|_, own| drop(own.take_if(|own| own.driver == self.number)));
    }
}

/// Turns setpoints into commands, one control step after another, until there is no driver or the episode has
/// ended.
async fn turn(any: OperatorHandle) {
    let mut ticks = interval(TICK);
    // Ticks that were missed are skipped, so that the loop never catches up.
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        ticks.tick().await;
        let mut round = any.round();
        if any.episode.ended() || round.operators.iter().all(|operator| operator.teleoperation.is_none()) {
            round.turning = false;
            return;
        }
        let now = Instant::now();
        for (seat, operator) in round.operators.iter_mut().enumerate() {
            if let Some((setpoint, tells_state)) = operator.due(now) {
                tokio::spawn(command(OperatorHandle { seat, ..any.clone() }, setpoint, tells_state));
            }
        }
    }
}

/// Executes a setpoint as a command and sends the driver the answer, with the robot's state if `tells_state`
/// is true.
async fn command(operator: OperatorHandle, setpoint: Setpoint, tells_state: bool) {
    let mut answers = vec![operator.call(setpoint.call().into(), None).await];
    if tells_state {
        let state = ToolCall::from(GetRobotState::of(operator.robot()));
        answers.push(operator.call(Call { samples: true, ..state.into() }, None).await);
    }
    operator.own(|own| {
        own.under_way = None;
        if let Some(teleoperation) = &own.teleoperation {
            for answer in answers {
                // A page that does not read its answers in time misses some of them.
                let _ = teleoperation.answers.try_send(answer);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use tandem_tools_spec::WristMove;

    use super::*;
    use crate::hosting::team::round::{Operator, Round};

    fn driven(go: bool, steps: u32) -> Operator {
        let (answers, _) = mpsc::channel(1);
        let mut teleoperation = Teleoperation::new(1, "A", answers);
        let setpoint = Setpoint::Wrists(WristMove::hold("A"));
        teleoperation.pass_time(&DriverRequest { setpoint, tells_state: false, go, steps });
        let mut operator = Round::new(["A"].into_iter()).operators.remove(0);
        operator.teleoperation = Some(teleoperation);
        operator
    }

    #[test]
    fn a_robot_moves_while_its_person_is_there_and_never_twice_in_a_step() {
        let now = Instant::now();
        assert!(driven(true, 0).due(now).is_some());
        assert!(driven(false, 0).due(now).is_none());
        assert!(driven(true, 0).due(now + 2 * AWAY_AFTER).is_none(), "a cut link moves nothing");
        let mut stepped = driven(false, 2);
        for expected in [true, false] {
            assert_eq!(stepped.due(now).is_some(), expected, "the command is not answered yet");
        }
        for expected in [true, false] {
            stepped.under_way = None;
            assert_eq!(stepped.due(now).is_some(), expected, "two steps were asked for");
        }
    }
}
