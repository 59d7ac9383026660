//! Who draws the pictures changes no state.

use tandem_episodes::{EpisodeSpec, RendererKind, Session};
use tandem_tools_spec::{Observe, Protocol};

use crate::common::*;

#[test]
fn episodes_go_the_same_way_whoever_draws() {
    let played = |renderer: RendererKind| {
        let spec = EpisodeSpec { renderer, ..spec("handover", 5, Protocol::Benchmark) };
        let mut session = Session::start(&spec, None).unwrap();
        for _ in 0..2 {
            session.call(Observe { robots: None, short: None }.into()).unwrap();
            command(&mut session, raise_hand(10));
        }
        session.close().state_hash
    };
    let hashes = RendererKind::ALL.map(played);
    assert!(hashes.iter().all(|hash| *hash == hashes[0]), "{hashes:?}");
}
