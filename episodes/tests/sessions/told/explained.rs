//! Tests of the next phase in `get_status` with `explain`.

use tandem_episodes::Session;
use tandem_episodes::players::{self, InProcess};
use tandem_tools_spec::{Assistance, Disclosure, GetStatus, ManageReply, NextPhase, Protocol, ToolReply};

use crate::common::*;

fn explained(session: &mut Session) -> Result<Option<NextPhase>, String> {
    match session.call(GetStatus { explain: true }.into()) {
        Ok(ToolReply::Manage(ManageReply::GetStatus(status))) => Ok(status.next_phase),
        Ok(other) => panic!("{other:?} is no status"),
        Err(error) => Err(error.to_string()),
    }
}

#[test]
fn the_next_phase_is_explained_to_who_asks_and_results_say_so() {
    let own = spec("handover", 2000, Protocol::Agentic).assisted(Assistance::Full);
    let mut session = Session::start(&own, None).unwrap();
    assert_eq!(status(&mut session).next_phase, None);
    assert!(!session.result().extra_information.contains(&"phase_conditions".to_owned()));
    let hash = session.state_hash();
    let next = explained(&mut session).unwrap().unwrap();
    assert_eq!((next.id.as_str(), next.number.as_str()), ("grasp_and_lift", "p1"));
    assert_eq!(next.lacks[0], "A's right hand does not hold bottle: the right one is off it");
    assert!(next.lacks[1].starts_with("lift_m(\"bottle\") >= 0.03: it is "), "{next:?}");
    assert_eq!(session.state_hash(), hash);
    assert_eq!(session.result().extra_information_replies["phase_conditions"]["B"], 1);
}

#[test]
fn a_held_thing_is_told_by_its_place_in_the_robots_level_frame() {
    let own = spec("handover", 2000, Protocol::Benchmark).assisted(Assistance::Full);
    let mut episode = InProcess::until(1, Session::start(&own, None).unwrap());
    assert!(explained(&mut episode.session).unwrap().unwrap().held.is_empty());
    // The expert's play ends with the phase.
    let _ = players::find("expert").unwrap().play(&own, &mut episode);
    let next = explained(&mut episode.session).unwrap().unwrap();
    let [held] = &next.held[..] else { panic!("one hand holds the bottle: {next:?}") };
    assert_eq!((&*held.robot, &*held.hand, &*held.object), ("A", "right", "bottle"));
    assert!(held.axis[2] > 0.97 && (0.82..0.95).contains(&held.lowest_m), "{held:?}");
    // A hand closes on an object 0.12 m along its fingers.
    let wrist_m = state(&mut episode.session, "A").right_wrist.position_m;
    let ahead_m = held.middle_m[0] - wrist_m[0];
    assert!((0.06..0.18).contains(&ahead_m), "{held:?}, wrist at {wrist_m:?}");
}

#[test]
fn what_is_not_told_is_not_explained() {
    let paper = spec("handover", 2000, Protocol::Agentic).assisted(Assistance::Paper);
    let refused = explained(&mut Session::start(&paper, None).unwrap()).unwrap_err();
    assert!(refused.contains("leave explain out"), "{refused}");
    let mut late = spec("handover", 2000, Protocol::Agentic).assisted(Assistance::Full);
    late.disclosure = Disclosure::End;
    assert_eq!(explained(&mut Session::start(&late, None).unwrap()), Ok(None));
}
