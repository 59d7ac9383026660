//! A test of replies on a pinch that is not scored as a grip: a round object between fingers that do not
//! oppose each other.

use serde_json::{Value, json};
use tandem_episodes::tasks::{Task, TaskSource};
use tandem_episodes::{A, EpisodeSpec, Grip as Truth, Session, task_of};
use tandem_sim::Side;
use tandem_tools_spec::{Call, Protocol};

const TEXT: &str = r#"
id = "hold_apple"
scene = "kitchen_084"
instruction = "Robot A lifts the apple."
budget.benchmark_steps = 1000

[[robots]]
name = "A"
position_m = [0.0, 0.0]
instruction = "Lift the apple."

[[objects]]
name = "apple"
position_m = [0.30, -0.07, 0.832]

[[phases]]
id = "lift"
description = "A's right hand holds the apple at least half a metre up."
done = 'holds("A", "right", "apple") && lift_m("apple") >= 0.5'
"#;

const OPEN_RAD: [f64; 7] = [0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0];
/// Finger angles at which the thumb presses on the side of the apple, and the fingers on its front.
const CLOSE_RAD: [f64; 7] = [-0.5, -0.9, -1.2, 1.3, 1.3, 1.3, 1.3];
/// Position of the apple's middle relative to the wrist: ahead, and to the left.
const PLACE_M: [f64; 2] = [0.16, 0.065];

fn apple() -> Task {
    let source = TaskSource { name: "hold_apple.toml".into(), text: TEXT.into(), ..TaskSource::default() };
    task_of(source).expect("a task")
}

/// Moves A's right hand and returns the report on it.
fn move_hand(session: &mut Session, mut entry: Value) -> Value {
    entry["robot"] = json!("A");
    let call = Call::parse("move_wrists", json!({ "steps": 25, "robots": [entry] })).expect("a command");
    json!(session.ask(None, call).expect("an answer").reply)["robots"][0]["right"].clone()
}

/// Moves the wrist to the apple, offset by `beside_m` to the right, and sets the fingers.
fn approach(session: &mut Session, beside_m: f64, fingers_rad: [f64; 7]) {
    let facts = session.facts();
    let apple_m = facts.robots[A].pelvis_in_world.inverse() * facts.object("apple").pose_in_world.translation;
    let [x_m, y_m, z_m] = apple_m.to_array().map(f64::from);
    let wrist_m = [x_m - PLACE_M[0], y_m - PLACE_M[1] - beside_m, z_m];
    let entry = json!({
        "right_position_m": wrist_m, "right_quaternion_wxyz": [1, 0, 0, 0], "right_fingers_rad": fingers_rad,
    });
    move_hand(session, entry);
}

/// For three seconds thumb and fingers press without a hold. Replies list the pressing parts, and report no
/// hold.
#[test]
fn a_pinch_that_is_not_scored_is_told_as_no_hold() {
    let mut session =
        Session::start(&EpisodeSpec::new(&apple(), 0, Protocol::Agentic), None).expect("an episode");
    (0..3).for_each(|_| approach(&mut session, 0.1, OPEN_RAD));
    (0..3).for_each(|_| approach(&mut session, 0.0, OPEN_RAD));
    (0..2).for_each(|_| approach(&mut session, 0.0, CLOSE_RAD));
    for _ in 0..6 {
        let hand = move_hand(&mut session, json!({ "right_fingers_rad": CLOSE_RAD }));
        let truth = session.facts().object("apple").hands[A][Side::Right];
        assert_eq!((truth, &hand["grip"]), (Truth::Touching, &json!("two_sided")), "{hand}");
        let presses = hand["presses"].as_array().expect("parts of the hand");
        assert!(presses.contains(&json!("thumb")) && presses.len() > 1, "{hand}");
        assert!(!hand.to_string().contains("hold"), "{hand}");
    }
}
