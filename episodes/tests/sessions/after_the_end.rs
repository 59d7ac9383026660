//! What an episode that has ended still answers, and that nothing runs on.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

use crate::common::*;
use tandem_episodes::{Clock, EpisodeError, Session};
use tandem_tools_spec::{
    CheckReach, EndReason, Finish, LookReply, Observe, Protocol, QueryDepth, Tool, ToolReply, Wait,
};

#[test]
fn looking_goes_on_after_the_end_and_the_clock_does_not() {
    let hands_s = Arc::new(AtomicU64::new(0));
    let read = hands_s.clone();
    let clock: Clock = Box::new(move || Duration::from_secs(read.load(Relaxed)));
    let mut session =
        Session::start_with_clock(&spec("handover", 0, Protocol::Agentic), None, clock).unwrap();
    hands_s.fetch_add(100, Relaxed);
    let before = (state(&mut session, "A"), session.state_hash());
    session.call(Finish {}.into()).unwrap();
    let ended = status(&mut session);
    assert_eq!((ended.budget.wall_clock_left_s, ended.ended), (Some(1700.0), Some(EndReason::Finished)));
    hands_s.fetch_add(1000, Relaxed);
    let observe = Observe { robots: None, short: Some(true) };
    let ToolReply::Look(LookReply::Observe(seen)) = session.call(observe.into()).unwrap() else {
        panic!("no observation")
    };
    assert_eq!((seen.images.len(), seen.states.len(), seen.time_s), (2, 2, ended.time_s));
    assert!(seen.states.iter().all(|state| state.joint_torques_n_m.is_none()), "the short form");
    session.call(QueryDepth::example().into()).unwrap();
    session.call(CheckReach::example().into()).unwrap();
    let refused = session.call(Wait { steps: 1 }.into()).unwrap_err();
    assert!(matches!(refused, EpisodeError::Ended { reason: EndReason::Finished }), "{refused}");
    assert_eq!((state(&mut session, "A"), session.state_hash()), before);
    assert_eq!(status(&mut session), ended, "neither the clock nor anything else has gone on");
}
