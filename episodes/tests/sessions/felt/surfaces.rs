//! Tests of surfaces in depth queries against the simulator's object poses.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use serde_json::{Value, json};
use tandem_episodes::{A, Session};
use tandem_sim::Pose;
use tandem_tools_spec::{Call, Color, DepthReply, JoinedBy, LookReply, Protocol, Surface, ToolReply};

use crate::common::*;

fn ask(session: &mut Session, tool: &str, args: Value) -> LookReply {
    match session.ask(None, Call::parse(tool, args).unwrap()).unwrap().reply {
        ToolReply::Look(reply) => reply,
        other => panic!("{other:?}"),
    }
}

fn isometry(position_m: [f64; 3], [w, x, y, z]: [f64; 4]) -> Isometry3<f64> {
    let turned = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    Isometry3::from_parts(Translation3::from(position_m), turned)
}

fn of_sim(pose: &Pose) -> Isometry3<f64> {
    let r = pose.rotation;
    isometry(pose.translation.to_array().map(f64::from), [r.w, r.x, r.y, r.z].map(f64::from))
}

/// Returns the pixel in A's image of a point `above_m` above an object's origin, and the point in A's
/// start frame.
fn seen(session: &mut Session, object: &str, above_m: f64) -> ([i64; 2], [f64; 3]) {
    let look = json!({ "robots": ["A"], "short": true });
    let LookReply::Observe(reply) = ask(session, "observe", look) else { panic!("no observation") };
    let camera = &reply.cameras[0];
    let from_camera = isometry(camera.camera_in_pelvis.position_m, camera.camera_in_pelvis.quaternion_wxyz);
    let facts = session.facts();
    let pelvis_from_world = of_sim(&facts.robots[A].pelvis_in_world).inverse();
    let mut at_m = Point3::from(facts.position_m(object).to_array().map(f64::from));
    at_m.z += above_m;
    let in_pelvis_m = pelvis_from_world * at_m;
    let in_camera_m = from_camera.inverse() * in_pelvis_m;
    let u = camera.fx * in_camera_m.x / in_camera_m.z + camera.cx;
    let v = camera.fy * in_camera_m.y / in_camera_m.z + camera.cy;
    let start = state(session, "A").pelvis_in_start.unwrap();
    let in_start_m = isometry(start.position_m, start.quaternion_wxyz) * in_pelvis_m;
    ([u.round() as i64, v.round() as i64], in_start_m.coords.into())
}

fn surfaces(session: &mut Session, query: Value) -> DepthReply {
    let args = json!({ "robot": "A", "surface": query, "frame": "start" });
    match ask(session, "query_depth", args) {
        LookReply::QueryDepth(reply) => reply,
        other => panic!("{other:?}"),
    }
}

/// A pixel on a bottle on the counter yields the whole bottle, without other objects, and its axis.
#[test]
fn a_pixel_on_a_bottle_tells_of_all_of_it() {
    let mut session = start("handover", 2011, Protocol::Agentic);
    let (pixel, at_m) = seen(&mut session, "bottle", 0.06);
    let reply = surfaces(&mut session, json!({ "pixel": pixel }));
    println!("{} at {pixel:?}, {at_m:?}", json!(reply.surfaces));
    let whole = reply.surfaces.last().unwrap();
    let axis = whole.axis.expect("it is upright and round");
    for (what, end_m) in [("bottom", axis.bottom_m), ("top", axis.top_m)] {
        let off_m = (end_m[0] - at_m[0]).hypot(end_m[1] - at_m[1]);
        assert!(off_m < 0.006, "the {what} of the axis is {off_m} m off: {axis:?}, and it is at {at_m:?}");
    }
    assert!((axis.radius_m - 0.035).abs() < 0.004, "{axis:?}");
    let height_m = axis.top_m[2] - axis.bottom_m[2];
    let told = session.briefing().room.into_iter().find(|line| line.starts_with("bottle")).unwrap();
    let size_m: f64 = told.split("its y, ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((height_m - size_m).abs() < 0.02, "{height_m} m high, and it is {size_m}: {whole:?}");
    assert!(whole.extent_m[0] < 0.09 && whole.extent_m[1] < 0.09, "nothing of the counter: {whole:?}");
}

/// One call describes every visible object, each like a call by its name.
#[test]
fn all_objects_are_told_at_once() {
    let mut session = start("handover", 2011, Protocol::Agentic);
    let all = surfaces(&mut session, json!({ "object": "all" })).surfaces;
    let names: Vec<&str> = all.iter().filter_map(|surface| surface.object.as_deref()).collect();
    assert_eq!(names, ["bottle", "target pad"]);
    for surface in &all {
        let alone = surfaces(&mut session, json!({ "object": surface.object })).surfaces;
        assert_eq!(alone, [Surface { object: None, ..surface.clone() }]);
    }
}

/// For every visible colour, surfaces come nearest first, and walls and floors last.
#[test]
fn surfaces_of_a_colour_are_things() {
    let mut session = start("cart_service", 2011, Protocol::Agentic);
    for color in Color::ALL {
        let call =
            Call::parse("query_depth", json!({ "robot": "A", "surface": { "color": color } })).unwrap();
        let Ok(reply) = session.ask(None, call) else { continue };
        let ToolReply::Look(LookReply::QueryDepth(reply)) = reply.reply else { panic!() };
        assert!((1..=3).contains(&reply.surfaces.len()) && reply.points.is_empty());
        assert!(reply.surfaces.iter().all(|surface| surface.joined_by == JoinedBy::Color));
        for surface in &reply.surfaces {
            println!(
                "{color:?}: {} px, {:?} m at {:?}",
                surface.pixels, surface.extent_m, surface.centroid_m
            );
        }
    }
    // The trolley's bar in front of A is the nearest yellow object.
    let bar = &surfaces(&mut session, json!({ "color": "yellow" })).surfaces[0];
    let facts = session.facts();
    let pelvis_from_world = of_sim(&facts.robots[A].pelvis_in_world).inverse();
    let place = facts.site("service_trolley", "left").position_m().to_array().map(f64::from);
    let trolley = of_sim(&facts.object("service_trolley").pose_in_world);
    let at_m = pelvis_from_world * trolley * Point3::from(place);
    let ahead_m = bar.centroid_m[0] - at_m.x;
    assert!(ahead_m.abs() < 0.05, "the bar is at {at_m}, and {bar:?} was found");
}
