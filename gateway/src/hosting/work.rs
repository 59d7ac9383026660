//! What the thread of an episode does for its callers, all of it between two other calls.

use tandem_episodes::{Called, OperatorCommand, Session};
use tandem_tools_spec::{Look, LookReply, Observation, ToolReply};

use super::{Answer, HostingError};

/// A call, who makes it, and what goes with it.
#[derive(Debug)]
pub struct Made {
    /// The robot whose operator makes it; `None` where one policy directs all.
    pub operator: Option<String>,
    pub called: Called,
    pub expected_step: Option<u32>,
    /// What to look at once it is done.
    pub then: Option<Look>,
}

/// Makes a call, unless it was made for another step or what is to be looked at afterwards cannot be.
pub fn make(session: &mut Session, made: &Made) -> Result<Answer, HostingError> {
    check_around(session, made.expected_step, made.then.as_ref())?;
    let operator = made.operator.as_deref();
    let reply = session.make(operator, &made.called)?;
    let mut answer = Answer::new(reply, session);
    if let Some(look) = &made.then {
        answer.observation = observed(session, operator, look)?;
    }
    Ok(answer)
}

/// Whether an operator's command could be executed as things stand.
pub fn check(
    session: &mut Session,
    command: &OperatorCommand,
    expected_step: Option<u32>,
    then: Option<&Look>,
) -> Result<(), HostingError> {
    check_around(session, expected_step, then)?;
    Ok(session.check(command)?)
}

/// Executes the commands of several operators side by side, and looks for each what it wants to see then.
pub fn together(
    session: &mut Session,
    commands: Vec<OperatorCommand>,
    looks: &[Option<Look>],
) -> Result<Vec<Answer>, HostingError> {
    let robots: Vec<String> = commands.iter().map(|command| command.robot.clone()).collect();
    let reply = session.make(None, &Called::Together(commands))?;
    let mut answers = Vec::with_capacity(robots.len());
    for (robot, look) in robots.iter().zip(looks) {
        let observation = match look {
            Some(look) => observed(session, Some(robot), look)?,
            None => None,
        };
        answers.push(Answer { observation, ..Answer::new(reply.clone(), session) });
    }
    Ok(answers)
}

fn check_around(
    session: &Session,
    expected_step: Option<u32>,
    then: Option<&Look>,
) -> Result<(), HostingError> {
    let now = session.env_steps();
    if let Some(expected) = expected_step.filter(|expected| *expected != now) {
        return Err(HostingError::OtherStep { expected, now });
    }
    Ok(then.map_or(Ok(()), |look| session.check_look(look))?)
}

fn observed(
    session: &mut Session,
    operator: Option<&str>,
    look: &Look,
) -> Result<Option<Observation>, HostingError> {
    match session.make(operator, &Called::look(look.clone()))? {
        ToolReply::Look(LookReply::Observe(observation)) => Ok(Some(observation)),
        _ => Ok(None),
    }
}
