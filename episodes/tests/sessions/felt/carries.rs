//! Tests of `walk_to` with a load: a trolley pushed by one robot, a basket carried by two. Only the
//! objects' positions come from the simulator; a policy would measure them.

use nalgebra::Vector3;
use serde_json::{Value, json};
use tandem_episodes::{A, B, Session};
use tandem_sim::Side;
use tandem_tools_spec::{Call, PlanReply, Protocol, ToolReply};

use super::grips::{Trial, heading_rad, isometry, upright};
use crate::common::*;

const NAMES: [&str; 3] = ["A", "B", "C"];

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

/// Raises both hands of A and B `times` times by `by_m`, with compliance and unchanged fingers.
fn move_up(session: &mut Session, by_m: f64, times: u32) {
    move_up_of(session, [A, B], by_m, times);
}

/// Raises both hands of these robots like [`move_up`].
fn move_up_of(session: &mut Session, robots: [usize; 2], by_m: f64, times: u32) {
    for _ in 0..times {
        if is_done(session) {
            break;
        }
        let facts = session.facts();
        let entry = |robot: usize| {
            let name = NAMES[robot];
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
        let robots: Vec<Value> = robots.into_iter().map(entry).collect();
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

/// Returns the mean distance between the facing hands of two robots that hold one load.
fn apart_m(session: &Session, [one, other]: [usize; 2]) -> f64 {
    let facts = session.facts();
    let wrist = |robot: usize, side: Side| {
        let robot = &facts.robots[robot];
        isometry(&robot.pelvis_in_world) * isometry(&robot.wrist_in_pelvis[side])
    };
    let apart = |own: Side, its: Side| {
        (wrist(one, own).translation.vector - wrist(other, its).translation.vector).norm()
    };
    0.5 * (apart(Side::Left, Side::Right) + apart(Side::Right, Side::Left))
}

/// Returns the distance between the pelvises of two robots on the floor.
fn stand_apart_m(session: &Session, [one, other]: [usize; 2]) -> f64 {
    let facts = session.facts();
    let pelvis_m = |robot: usize| facts.robots[robot].pelvis_in_world.translation;
    let apart = pelvis_m(one) - pelvis_m(other);
    f64::from(apart.truncate().length())
}

/// Carries a load by three calls of `walk_to`, each by [x, y] of the room, and checks that it is held as after
/// the lift.
fn carry_in_three_legs(seed: u32, [one, other]: [&Trial; 2], (lift_m, leg_m): (f64, [f64; 2])) {
    let robots = [one.robot, other.robot];
    let names = robots.map(|robot| NAMES[robot]);
    let mut session = start(one.task, seed, Protocol::Agentic);
    one.take(&mut session);
    other.take(&mut session);
    move_up_of(&mut session, robots, lift_m / 3.0, 3);
    let began = [apart_m(&session, robots), stand_apart_m(&session, robots)];
    println!("{} {seed}: hands {:.3} m apart, robots {:.3}", one.task, began[0], began[1]);
    for leg in 1..=3 {
        let facts = session.facts();
        let by_m = robots.map(|robot| {
            let heading = heading_rad(&isometry(&facts.robots[robot].pelvis_in_world));
            let (sine, cosine) = heading.sin_cos();
            [cosine * leg_m[0] + sine * leg_m[1], cosine * leg_m[1] - sine * leg_m[0]]
        });
        let reply = carry(&mut session, &names, by_m, 1500);
        let now = [apart_m(&session, robots), stand_apart_m(&session, robots)];
        let hands = reply.last.robots.iter().flat_map(|report| [&report.left, &report.right]);
        let most_n = hands
            .filter_map(|hand| hand.force_n)
            .map(|force_n| force_n[0].hypot(force_n[1]))
            .fold(0.0, f64::max);
        println!(
            "leg {leg}, {} steps: hands {:.3}, robots {:.3}, up to {most_n:.1} N aside; {:?}",
            reply.executed_steps, now[0], now[1], reply.stopped
        );
        assert_eq!(reply.stopped, None, "leg {leg}");
        assert!(one.holds(&session) && other.holds(&session), "leg {leg}: all hands still hold it");
        assert!((now[0] - began[0]).abs() < 0.02, "leg {leg}: hands were {:.3} apart: {now:?}", began[0]);
        assert!((now[1] - began[1]).abs() < 0.03, "leg {leg}: robots were {:.3} apart: {now:?}", began[1]);
        assert!(most_n < 15.0, "leg {leg}: {most_n} N");
    }
}

/// Walking legs neither decrease nor increase the squeeze of the hands.
#[test]
fn a_load_is_held_alike_after_each_of_three_legs() {
    let trial = |task, thing, object, robot, places, heading_rad| Trial {
        thing,
        task,
        robot,
        object,
        places,
        heading_rad,
        walks: true,
    };
    let basket =
        |robot, places, heading_rad| trial("co_carry", "rim of 24 mm", "basket", robot, places, heading_rad);
    let table = |robot, places, heading_rad| {
        trial("table_align", "edge of a plate", "office_table", robot, places, heading_rad)
    };
    let of_a: &[_] = &[(Side::Left, "a_left"), (Side::Right, "a_right")];
    let of_b: &[_] = &[(Side::Left, "b_left"), (Side::Right, "b_right")];
    let pi = std::f64::consts::PI;
    for seed in [2012, 2301] {
        carry_in_three_legs(seed, [&basket(A, of_a, 0.0), &basket(B, of_b, pi)], (0.09, [0.0, -0.35]));
        carry_in_three_legs(seed, [&table(A, of_a, 0.0), &table(B, of_b, pi)], (0.09, [0.0, -0.4]));
    }
}
