//! Tests of the teleoperation page: its contents, and that time stops while an operator is absent.

use serde_json::{Value, json};
use tandem::{settings::Layer, token::Token};
use tandem_tests::TestServer;

use super::team::Team;

/// Returns an operator's command of 0.1 s that moves a wrist and closes a hand.
fn tick(robot: &str, x_m: f64) -> Value {
    json!({ "steps": 5, "robots": [{
        "robot": robot, "carried": true, "vx_m_s": 0, "vy_m_s": 0, "yaw_rate_rad_s": 0,
        "right_position_m": [x_m, -0.2, 0.2], "right_fingers_rad": [0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3],
    }] })
}

#[test]
fn everybody_may_read_the_page_and_nobody_acts_without_a_link() {
    let token = Token::parse("correct-horse-battery-staple", "a test").expect("a token");
    let server = TestServer::with(Layer { token: Some(token), ..Layer::default() });
    let (status, headers, page) = server.ask("GET", "/operate", &[("accept", "text/html")], b"");
    let page = String::from_utf8_lossy(&page).into_owned();
    assert!(status == 200 && format!("{headers:?}").contains("default-src 'none'"), "{status} {headers:?}");
    assert!(!page.contains("http://") && !page.contains("https://"), "{page}");
    for path in ["page.css", "page.js"] {
        assert_eq!(server.ask("GET", &format!("/operate/{path}"), &[], b"").0, 200, "{path}");
    }
    for path in [
        "/operate/",
        "/operate/other.js",
        "/operate/drive",
        "/operate/texture",
        "/operate/collection",
        "/operated",
        "/v1/tasks",
    ] {
        assert_eq!(server.get(path).status, 401, "{path}");
    }
    let forged = [("authorization", "Bearer 0123456789abcdef0123456789abcdef01234567")];
    assert_eq!(server.ask("GET", "/v1/tasks", &forged, b"").0, 401);
}

#[test]
fn two_people_drive_and_time_stands_still_while_one_is_away() {
    let team = Team::start(json!({ "patience_s": 600, "talk": true }));
    for turn in 0..4 {
        let x_m = 0.15 + 0.02 * f64::from(turn);
        let replies = team.both(("move_wrists", tick("A", x_m)), ("move_wrists", tick("B", x_m)));
        for reply in replies {
            assert_eq!(reply.ok()["executed_steps"], 5);
        }
    }
    let steps = || team.server.get(&format!("/v1/episodes/{}", team.id)).ok()["env_steps"].clone();
    let before = steps();
    std::thread::scope(|scope| {
        // B is absent, so A's command waits and simulated time stops.
        let waiting = scope.spawn(|| team.ask(0, "move_wrists", tick("A", 0.25)));
        std::thread::sleep(std::time::Duration::from_secs(1));
        assert!(!waiting.is_finished());
        assert_eq!(steps(), before);
        // B returns.
        let back = team.ask(1, "move_wrists", tick("B", 0.25)).ok();
        assert_eq!(back["partners"], json!([{ "robot": "A", "did": "acted", "tool": "move_wrists" }]));
        assert_eq!(waiting.join().expect("A's answer").ok()["executed_steps"], 5);
    });
    // One robot's link does not permit commands to another robot.
    team.ask(0, "move_wrists", tick("B", 0.2)).refused(409, &["another operator's"]);
    team.verified();
}
