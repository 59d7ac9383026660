//! Tests of endings: the disclosure of success, the calls that remain available, and stopped clocks.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Duration;

use crate::common::*;
use tandem_episodes::players::{self, InProcess};
use tandem_episodes::{Clock, EpisodeError, EpisodeSpec, Session};
use tandem_tools_spec::{
    CheckReach, Disclosure, EndReason, Finish, LookReply, ManageReply, Observe, Protocol, QueryDepth, Tool,
    ToolReply, Wait,
};

#[test]
fn success_is_told_and_ends_the_episode_as_the_disclosure_says() {
    for (disclosure, told_under_way, told_at_the_end, ended) in [
        (Disclosure::Live, 3, 3, EndReason::TaskComplete),
        (Disclosure::End, 0, 3, EndReason::Finished),
        (Disclosure::Never, 0, 0, EndReason::Finished),
    ] {
        let spec = EpisodeSpec { disclosure, ..spec("pouring", 3, Protocol::Benchmark) };
        let mut episode = InProcess::new(Session::start(&spec, None).unwrap());
        players::find("expert").unwrap().play(&spec, &mut episode).unwrap();
        let mut session = episode.session;
        let before = status(&mut session);
        let unusual = Some(disclosure).filter(|told| *told != Disclosure::Live);
        assert_eq!((before.disclosure, before.phases.len()), (unusual, told_under_way));
        assert_eq!(before.ended.is_some(), disclosure == Disclosure::Live, "{disclosure}");
        let ToolReply::Manage(ManageReply::Finish(result)) = session.call(Finish {}.into()).unwrap() else {
            panic!("no result")
        };
        let told = result.phases.0.iter().filter(|(_, time_s)| time_s.is_some()).count();
        assert_eq!((told, result.ended), (told_at_the_end, ended), "{disclosure}");
        assert_eq!(status(&mut session).phases.len(), told_at_the_end, "{disclosure}");
        // The stored result does not depend on the disclosure.
        let kept = session.close();
        assert!(kept.phases.0.iter().all(|(_, time_s)| time_s.is_some()), "{disclosure}: {kept:?}");
    }
}

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
    let observe = Observe { short: Some(true), ..Observe::of_all() };
    let ToolReply::Look(LookReply::Observe(seen)) = session.call(observe.into()).unwrap() else {
        panic!("no observation")
    };
    assert_eq!((seen.images.len(), seen.states.len(), seen.time_s), (2, 2, ended.time_s));
    assert!(seen.states.iter().all(|state| state.joint_torques_n_m.is_none()), "the short form");
    session.call(QueryDepth::example().into()).unwrap();
    session.call(CheckReach::example().into()).unwrap();
    let refused = session.call(Wait { steps: 1 }.into()).unwrap_err();
    assert!(matches!(refused, EpisodeError::Ended { reason: EndReason::Finished, .. }), "{refused}");
    assert_eq!((state(&mut session, "A"), session.state_hash()), before);
    assert_eq!(status(&mut session), ended, "neither the clock nor anything else has gone on");
}
