//! What a policy is told about its success, and whether success ends its episode.

use tandem_episodes::players::{self, InProcess};
use tandem_episodes::{EpisodeSpec, Session};
use tandem_tools_spec::{Disclosure, EndReason, Finish, ManageReply, Protocol, ToolReply};

use crate::common::{spec, status};

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
        assert_eq!((before.disclosure, before.phases.len()), (disclosure, told_under_way));
        assert_eq!(before.ended.is_some(), disclosure == Disclosure::Live, "{disclosure}");
        let ToolReply::Manage(ManageReply::Finish(result)) = session.call(Finish {}.into()).unwrap() else {
            panic!("no result")
        };
        let told = result.phases.0.iter().filter(|(_, time_s)| time_s.is_some()).count();
        assert_eq!((told, result.ended), (told_at_the_end, ended), "{disclosure}");
        assert_eq!(status(&mut session).phases.len(), told_at_the_end, "{disclosure}");
        // What is kept does not depend on what was told.
        let kept = session.close();
        assert!(kept.phases.0.iter().all(|(_, time_s)| time_s.is_some()), "{disclosure}: {kept:?}");
    }
}
