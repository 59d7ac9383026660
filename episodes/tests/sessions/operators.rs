//! Tests of calls with options around them, and of commands from several operators in one process.

use tandem_episodes::{EpisodeError, OperatorCall, Session};
use tandem_tools_spec::{Call, Formats, Look, Observe, StopReason, TalkReply, ToolCall, ToolReply, Wait};

use super::common::{command, handover, raise_hand, squat, status};

fn look() -> Look {
    Look { observe: Observe { short: Some(true), ..Observe::of_all() }, formats: Formats::default() }
}

fn wait(steps: u32) -> Call {
    ToolCall::from(Wait { steps }).into()
}

fn calls(session: &mut Session) -> u32 {
    session.result().tool_calls
}

#[test]
fn what_stands_around_a_command_is_seen_to() {
    let mut session = handover(0);
    let ahead = Call { expected_step: Some(3), ..wait(2) };
    let refused = session.ask(None, ahead.clone()).unwrap_err();
    assert!(matches!(refused, EpisodeError::OtherStep { expected: 3, now: 0 }), "{refused}");
    let nobody = Look { observe: Observe { robots: Some(vec!["Z".into()]), ..Observe::of_all() }, ..look() };
    let refused = session.ask(None, Call { then: Some(nobody), ..wait(2) }).unwrap_err();
    assert!(matches!(refused, EpisodeError::UnknownRobot { .. }), "{refused}");
    assert_eq!((calls(&mut session), status(&mut session).env_steps), (0, 0), "neither counts");
    let seen = session.ask(None, Call { then: Some(look()), ..wait(3) }).unwrap();
    assert_eq!(seen.observation.unwrap().states.len(), 2);
    assert!(session.ask(None, ahead).unwrap().observation.is_none());
    assert_eq!(status(&mut session).env_steps, 5);
}

#[test]
fn commands_that_were_read_before_are_executed_as_things_stand_then() {
    let (raise, sink) = (raise_hand(25), squat(0.70));
    let read = |session: &mut Session, robot: &str, call: Call| {
        session.read_command(OperatorCall::new(robot, call).unwrap())
    };
    let mut session = handover(0);
    let refused = read(&mut session, "A", wait(51)).unwrap_err();
    assert!(matches!(refused, EpisodeError::TooManySteps { asked: 51, .. }), "{refused}");
    assert_eq!(calls(&mut session), 1, "a refusal counts");
    let early = read(&mut session, "A", raise.clone().into()).unwrap();
    let other = read(&mut session, "B", Call { then: Some(look()), ..sink.clone().into() }).unwrap();
    assert_eq!((early.robot(), early.steps(), other.steps(), calls(&mut session)), ("A", 25, 50, 1));
    // The other operator's robot moves meanwhile.
    let replies = session.together(vec![other]).unwrap();
    let ToolReply::Act(reply) = &replies[0].reply else { panic!("{replies:?}") };
    assert_eq!((reply.executed_steps, reply.stop_reason), (50, StopReason::StepsDone));
    assert_eq!(replies[0].observation.as_ref().unwrap().states[0].robot, "B");
    let ToolReply::Act(reply) = &session.together(vec![early]).unwrap()[0].reply else { panic!() };
    assert_eq!((reply.executed_steps, reply.robots.len()), (25, 1));

    let mut alone = handover(0);
    command(&mut alone, sink);
    command(&mut alone, raise);
    assert_eq!(session.state_hash(), alone.state_hash());
}

#[test]
fn what_an_operator_says_is_answered_with_the_status() {
    let mut session = handover(0);
    let say = Call::parse("say", serde_json::json!({ "text": "Ready." })).unwrap();
    match session.ask(Some("A"), say.clone()).unwrap().reply {
        ToolReply::Talk(TalkReply::Say(told)) => assert_eq!(told, status(&mut session)),
        other => panic!("{other:?}"),
    }
    session.call(tandem_tools_spec::Finish {}.into()).unwrap();
    assert!(matches!(session.ask(Some("A"), say), Err(EpisodeError::Ended { .. })));
}
