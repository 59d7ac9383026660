//! Tests of server restarts during teleoperation: the operators' pages, the expert and a policy continue.

use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tandem::hosting::Guests;

use super::{
    driving::DriversSocket,
    partners::{EXPERT, POLICY, ask_for, guests_with_policy},
    team::Team,
};
use crate::policies::act_server::ActServer;

/// Drives robot A for at least `steps` control steps and returns the number of the last. Each step needs a
/// command for both robots.
fn drive(team: &Team, steps: f32) -> f32 {
    let mut page = DriversSocket::open(team, 0);
    let (began, mut first) = (Instant::now(), None);
    loop {
        assert!(began.elapsed() < Duration::from_secs(60), "time stands still after {:?}", page.step());
        page.say(json!({}), true);
        page.read();
        let step = page.step();
        if step > 0.0 && step >= *first.get_or_insert(step) + steps {
            return step;
        }
    }
}

fn notes(team: &Team) -> (Value, String) {
    let (result, recording) = team.verified();
    (result, format!("{:?}", recording.transcript().expect("a transcript")))
}

#[test]
fn a_page_and_the_expert_drive_on_after_a_restart() {
    let mut team = Team::start(json!({ "patience_s": 600, "protocol": "agentic" }));
    assert_eq!(ask_for(&team, EXPERT), 204);
    let before = drive(&team, 10.0);
    team.server.restart(Guests::default());
    // The expert continues without a request. Without it, a step would wait ten minutes for robot B.
    assert!(drive(&team, 10.0) > before, "it begins where it was");
    let (result, notes) = notes(&team);
    assert_eq!(notes.matches("The task's expert drives robot B.").count(), 2, "{notes}");
    assert!(result["extra_information"].to_string().contains("third_person"), "{result}");
}

#[test]
fn a_policy_drives_on_after_a_restart_and_nobody_waits_for_one_that_the_server_lacks() {
    let mut row = vec![0.0; 35];
    row[34] = 0.76;
    let act = ActServer::start(move |_| (200, json!({ "actions": vec![row.clone(); 5] })));
    let mut team = Team::start(json!({ "patience_s": 600, "protocol": "agentic" }));
    team.server.restart(guests_with_policy(&act.url()));
    assert_eq!(ask_for(&team, POLICY), 204);
    let before = drive(&team, 10.0);
    let asked = || act.requests.lock().expect("no panic").len();
    let asked_before = asked();
    team.server.restart(guests_with_policy(&act.url()));
    let again = drive(&team, 10.0);
    assert!(again > before && asked() > asked_before, "it is asked again");
    team.server.restart(Guests::default());
    assert!(drive(&team, 10.0) > again, "robot B stands still, and nobody waits for it");
    let (_, notes) = notes(&team);
    assert_eq!(notes.matches(&format!("The policy act:{} drives robot B.", act.url())).count(), 2, "{notes}");
}
