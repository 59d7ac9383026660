//! Tests of `walk_to` with a load: a trolley pushed by one robot, a basket carried by two. Only the
//! objects' positions come from the simulator; a policy would measure them.

use nalgebra::Vector3;
use serde_json::{Value, json};
use tandem_episodes::{A, B, Session};
use tandem_sim::Side;
use tandem_tools_spec::{Call, PlanReply, Protocol, ToolReply};

use super::grips::{Trial, heading_rad, isometry, upright};
use crate::common::*;

fn ask(session: &mut Session, tool: &str, args: Value) -> ToolReply {
    session.ask(None, Call::parse(tool, args).unwrap()).unwrap().reply
}

fn plan(session: &mut Session, tool: &str, args: Value) -> PlanReply {
    match ask(session, tool, args) {
        ToolReply::Plan(reply) => reply,
        other => panic!("{other:?}"),
    }
}

/// Calls `walk_to` with `carry` for these robots. Each moves by [ahead, left] in its current heading.
fn carry(session: &mut Session, robots: &[&str], by_m: [[f64; 2]; 2], steps: u32) -> PlanReply {
    let entries: Vec<Value> = robots
        .iter()
        .zip(by_m)
        .map(|(robot, [ahead_m, left_m])| {
            let now = state(session, robot).pelvis_in_start.unwrap();
            let [w, x, y, z] = now.quaternion_wxyz;
            let heading = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
            let to_m = [
                now.position_m[0] + heading.cos() * ahead_m - heading.sin() * left_m,
                now.position_m[1] + heading.sin() * ahead_m + heading.cos() * left_m,
            ];
            json!({ "robot": robot, "to_m": to_m, "carry": true })
        })
        .collect();
    plan(session, "walk_to", json!({ "steps": steps, "robots": entries }))
}

/// Returns true once the task is complete, for example when the load has been set down and released.
fn is_done(session: &Session) -> bool {
    session.result().phases.0.iter().all(|(_, time_s)| time_s.is_some())
}

/// Raises both hands of both robots `times` times by `by_m`, with compliance and unchanged fingers.
fn move_up(session: &mut Session, by_m: f64, times: u32) {
    for _ in 0..times {
        if is_done(session) {
            break;
        }
        let facts = session.facts();
        let entry = |(robot, name): (usize, &&str)| {
            let pelvis = isometry(&facts.robots[robot].pelvis_in_world);
            let level_from_pelvis = upright(&pelvis).inverse() * pelvis;
            let mut entry = json!({ "robot": name, "frame": "level", "compliance_n_s_m": 250 });
            for side in Side::BOTH {
                let wrist = level_from_pelvis * isometry(&facts.robots[robot].wrist_in_pelvis[side]);
                let at: [f64; 3] = (wrist.translation.vector + Vector3::z() * by_m).into();
                let turned = wrist.rotation;
                entry[format!("{}_position_m", side.name())] = json!(at);
                entry[format!("{}_quaternion_wxyz", side.name())] =
                    json!([turned.w, turned.i, turned.j, turned.k]);
            }
            entry
        };
        let robots: Vec<Value> = ["A", "B"].iter().enumerate().map(entry).collect();
        ask(session, "move_wrists", json!({ "steps": 20, "robots": robots }));
    }
}

#[test]
fn a_robot_pushes_a_trolley_by_one_call() {
    let trial = Trial {
        thing: "bar of 36 mm",
        task: "cart_service",
        robot: A,
        object: "service_trolley",
        places: &[(Side::Left, "left"), (Side::Right, "right")],
        heading_rad: -std::f64::consts::FRAC_PI_2,
        walks: true,
    };
    let mut session = start("cart_service", 2012, Protocol::Agentic);
    trial.take(&mut session);
    let facts = session.facts();
    let way_m = facts.position_m("parking_mark") - facts.position_m("service_trolley");
    let ahead_m = f64::from(way_m.length());
    let reply = carry(&mut session, &["A"], [[ahead_m, 0.0]; 2], 1500);
    let facts = session.facts();
    let off_m = facts.position_m("parking_mark") - facts.position_m("service_trolley");
    println!("{ahead_m:.2} m in {} steps, {off_m} off: {:?}", reply.executed_steps, reply.stopped);
    println!("{}", json!(reply.last));
    assert_eq!(reply.stopped, None);
    assert!(off_m.length() < 0.12, "{off_m}");
    assert!(reply.last.phases.iter().any(|phase| phase.number == "p1"), "{:?}", reply.last.phases);
    assert!(!facts.robots[A].fallen);
    assert!(trial.holds(&session), "it still holds the bar");
}

#[test]
fn two_robots_carry_a_basket_by_one_call() {
    let trial = |robot: usize, places: &'static [(Side, &'static str)], heading_rad: f64| Trial {
        thing: "rim of 24 mm",
        task: "co_carry",
        robot,
        object: "basket",
        places,
        heading_rad,
        walks: true,
    };
    let mut session = start("co_carry", 2012, Protocol::Agentic);
    let a = trial(A, &[(Side::Left, "a_left"), (Side::Right, "a_right")], 0.0);
    let b = trial(B, &[(Side::Left, "b_left"), (Side::Right, "b_right")], std::f64::consts::PI);
    a.take(&mut session);
    b.take(&mut session);
    // Both lift by 9 cm with compliance.
    move_up(&mut session, 0.03, 3);
    assert!(session.facts().lift_m("basket") > 0.04, "lifted {}", session.facts().lift_m("basket"));
    // The displacement to the patch in each robot's heading.
    let facts = session.facts();
    let way_m = facts.position_m("basket_patch") - facts.position_m("basket");
    let way_m = Vector3::new(f64::from(way_m.x), f64::from(way_m.y), 0.0);
    let by_m = [A, B].map(|robot| {
        let heading = heading_rad(&isometry(&facts.robots[robot].pelvis_in_world));
        let (sine, cosine) = heading.sin_cos();
        [cosine * way_m.x + sine * way_m.y, cosine * way_m.y - sine * way_m.x]
    });
    let reply = carry(&mut session, &["A", "B"], by_m, 1500);
    let facts = session.facts();
    let off_m = facts.position_m("basket_patch") - facts.position_m("basket");
    println!("{:.2} m in {} steps, {off_m} off: {:?}", way_m.norm(), reply.executed_steps, reply.stopped);
    println!("{}", json!(reply.last));
    assert_eq!(reply.stopped, None);
    assert!(off_m.truncate().length() < 0.12, "{off_m}");
    assert!(reply.last.phases.iter().any(|phase| phase.number == "p2"), "{:?}", reply.last.phases);
    assert!(a.holds(&session) && b.holds(&session), "all hands still hold the rim");
    // Lowers the load as the brief describes, and opens the hands.
    move_up(&mut session, -0.03, 4);
    let open = json!([0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let opened = json!([0.0, -0.3, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let hands = |name: &str| json!({ "robot": name, "right_fingers_rad": open, "left_fingers_rad": opened });
    for _ in 0..2 {
        if !is_done(&session) {
            ask(&mut session, "move_wrists", json!({ "steps": 25, "robots": [hands("A"), hands("B")] }));
        }
    }
    move_up(&mut session, 0.04, 3);
    let facts = session.facts();
    let off_m = facts.position_m("basket_patch") - facts.position_m("basket");
    assert!(off_m.truncate().length() < 0.15, "{off_m}");
    assert!(is_done(&session), "{:?}, set down {off_m} off", session.result().phases);
    assert!(!facts.robots.iter().any(|robot| robot.fallen));
}
