//! Tests of surfaces of objects by name, and of images of depth: both are for full assistance, and results
//! name them.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use serde_json::{Value, json};
use tandem_episodes::{A, Session};
use tandem_tools_spec::{
    Assistance, Call, DepthReply, JoinedBy, LookReply, Observation, Protocol, Surface, ToolReply,
};

use crate::common::*;

fn ask(session: &mut Session, tool: &str, args: Value) -> Result<ToolReply, String> {
    let call = Call::parse(tool, args).map_err(|error| error.to_string())?;
    session.ask(None, call).map(|answer| answer.reply).map_err(|error| error.to_string())
}

fn points(session: &mut Session, args: Value) -> Result<DepthReply, String> {
    match ask(session, "query_depth", args)? {
        ToolReply::Look(LookReply::QueryDepth(reply)) => Ok(reply),
        other => panic!("{other:?}"),
    }
}

fn seen_by(session: &mut Session, robot: &str, object: &str) -> Result<Surface, String> {
    let args = json!({ "robot": robot, "surface": { "object": object }, "frame": "room" });
    let mut reply = points(session, args)?;
    assert_eq!(reply.surfaces.len(), 1, "pieces of one object are one surface");
    Ok(reply.surfaces.remove(0))
}

fn counted(session: &Session, what: &str) -> Value {
    json!(session.result().extra_information_replies)[what].clone()
}

/// Both robots look at the bottle from two sides, and receive the same coordinates of its axis.
#[test]
fn an_object_is_found_by_its_name() {
    let own = spec("handover", 2011, Protocol::Agentic).assisted(Assistance::Full);
    let mut session = Session::start(&own, None).unwrap();
    let hash = session.state_hash();
    let facts = session.facts();
    let [x_m, y_m] = own.task.robots[A].position_m;
    let bottle_m = facts.position_m("bottle");
    for robot in ["A", "B"] {
        let bottle = seen_by(&mut session, robot, "bottle").unwrap();
        println!("{robot}: {}", json!(bottle));
        assert_eq!(bottle.joined_by, JoinedBy::Object);
        let axis = bottle.axis.expect("it is upright and round");
        // Its near side is seen from bottom to top.
        let middle_m = 0.5 * (axis.bottom_m[2] + axis.top_m[2]);
        assert!((bottle.middle_m[2] - middle_m).abs() < 0.02, "{:?} and {axis:?}", bottle.middle_m);
        for end_m in [axis.bottom_m, axis.top_m] {
            let off_m =
                (end_m[0] - f64::from(bottle_m.x - x_m)).hypot(end_m[1] - f64::from(bottle_m.y - y_m));
            assert!(off_m < 0.012, "{robot} sees it {off_m} m off: {axis:?}");
        }
    }
    assert_eq!(session.state_hash(), hash);
    assert_eq!(counted(&session, "object_pixels"), json!({ "A": 1, "B": 1 }));
    assert!(seen_by(&mut session, "A", "target_pad").is_ok(), "underscores are spaces");
    let refused = seen_by(&mut session, "A", "vase").unwrap_err();
    assert!(refused.contains("no \"vase\"; have: bottle, target pad"), "{refused}");
    assert_eq!(counted(&session, "object_pixels"), json!({ "A": 2, "B": 1 }));
}

/// A refusal also gives information: the object is out of sight.
#[test]
fn what_is_not_seen_has_no_surface() {
    let own = spec("handover", 2011, Protocol::Agentic).assisted(Assistance::Full);
    let mut session = Session::start(&own, None).unwrap();
    for _ in 0..5 {
        let aside =
            json!({ "robot": "A", "vx_m_s": 0, "vy_m_s": 0, "yaw_rate_rad_s": 0, "waist_yaw_rad": 1.9 });
        ask(&mut session, "walk", json!({ "steps": 25, "robots": [aside] })).unwrap();
    }
    let refused = seen_by(&mut session, "A", "bottle").unwrap_err();
    assert!(refused.contains("does not see the bottle") && refused.contains("look_at_m"), "{refused}");
    assert_eq!(counted(&session, "object_pixels"), json!({ "A": 1 }));
}

/// The leaf of a door is a part that moves.
#[test]
fn an_object_is_all_of_its_parts() {
    let own = spec("move_house", 2011, Protocol::Agentic).assisted(Assistance::Full);
    let mut session = Session::start(&own, None).unwrap();
    let refused = seen_by(&mut session, "A", "x").unwrap_err();
    let have = refused.split("have: ").nth(1).unwrap();
    let parts: Vec<&str> = have.split(", ").filter(|name| name.starts_with("lever door ")).collect();
    assert_eq!(parts.len(), 3, "{have}");
    let mut pixels =
        |robot: &str, name: &str| seen_by(&mut session, robot, name).map_or(0, |seen| seen.pixels);
    let robot =
        ["A", "B", "C"].into_iter().find(|robot| pixels(robot, parts[0]) > 0).expect("a door in sight");
    let whole = pixels(robot, "lever door");
    let moving: u32 = parts.iter().map(|part| pixels(robot, part)).sum();
    assert!(0 < moving && moving < whole, "{moving} of {whole} pixels move");
}

/// The patch on the other shelf is a separate object, 1.2 m from the basket.
#[test]
fn a_longer_name_is_another_object() {
    let own = spec("co_carry", 2011, Protocol::Agentic).assisted(Assistance::Full);
    let mut session = Session::start(&own, None).unwrap();
    let basket = seen_by(&mut session, "A", "basket").unwrap();
    let longest_m = basket.extent_m.into_iter().fold(0.0, f64::max);
    assert!((0.4..0.8).contains(&longest_m), "{basket:?}");
}

fn observe(session: &mut Session, args: Value) -> Result<Observation, String> {
    match ask(session, "observe", args)? {
        ToolReply::Look(LookReply::Observe(seen)) => Ok(seen),
        other => panic!("{other:?}"),
    }
}

/// The grey of every tenth pixel is the depth that `query_depth` measures there.
#[test]
fn an_image_of_depth_is_what_pixels_measure() {
    let own = spec("handover", 2011, Protocol::Agentic).assisted(Assistance::Full);
    let mut session = Session::start(&own, None).unwrap();
    assert!(observe(&mut session, json!({ "robots": ["A"] })).unwrap().depth_images.is_empty());
    assert_eq!(counted(&session, "depth_images"), Value::Null);
    let seen = observe(&mut session, json!({ "robots": ["B", "A"], "depth_image": true })).unwrap();
    assert_eq!(counted(&session, "depth_images"), json!({ "A": 1, "B": 1 }));
    let robots: Vec<&str> = seen.depth_images.iter().map(|image| image.robot.as_str()).collect();
    assert_eq!((robots, seen.images.len()), (vec!["B", "A"], 2));
    let depth = &seen.depth_images[1];
    let grey = image::load_from_memory(&depth.png_base64.0).unwrap().into_luma8();
    assert_eq!(grey.dimensions(), (320, 240));
    let camera = seen.cameras[1].camera_in_pelvis;
    let [w, i, j, k] = camera.quaternion_wxyz;
    let turned = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    let pelvis_from_camera = Isometry3::from_parts(Translation3::from(camera.position_m), turned);
    let region = json!({ "from": [0, 0], "to": [319, 239], "stride": 10 });
    let measured = points(&mut session, json!({ "robot": "A", "region": region })).unwrap().points;
    let (white, black) = (1.0 / depth.white_m, 1.0 / depth.black_m);
    let mut compared = 0;
    for row in measured {
        let Some(point_m) = row.point_m() else { continue };
        let depth_m = pelvis_from_camera.inverse_transform_point(&Point3::from(point_m)).z;
        let share = ((1.0 / depth_m - black) / (white - black)).clamp(0.0, 1.0);
        let found = f64::from(grey.get_pixel(row.0 as u32, row.1 as u32).0[0]);
        assert!((found - 255.0 * share).abs() < 2.0, "{found} at {row:?}, {depth_m} m");
        compared += 1;
    }
    assert!(compared > 500, "{compared} pixels");
}

#[test]
fn neither_is_for_paper() {
    let paper = spec("handover", 2011, Protocol::Agentic).assisted(Assistance::Paper);
    let mut session = Session::start(&paper, None).unwrap();
    let object = json!({ "robot": "A", "surface": { "object": "bottle" } });
    let refused = points(&mut session, object).unwrap_err();
    assert!(refused.contains("give pixels or region"), "{refused}");
    let refused = observe(&mut session, json!({ "depth_image": true })).unwrap_err();
    assert!(refused.contains("leave depth_image out"), "{refused}");
    let state = ask(&mut session, "get_robot_state", json!({ "robot": "A", "frame": "room" })).unwrap_err();
    assert!(state.contains("leave frame out"), "{state}");
    assert_eq!(session.result().extra_information, [""; 0]);
}
