//! A test of the numbers in the description of `move_wrists`: a policy that uses only the tools' texts
//! and measurements lifts the bottle.

use serde_json::{Value, json};
use tandem_tests::TestServer;

/// Pixel on the body of Handover's bottle in robot A's image on seed 0. A person or a model would find it in
/// the image.
const PIXEL: [u32; 2] = [188, 215];
const BOTTLE_RADIUS_M: f64 = 0.035;
const OPEN_RAD: [f64; 7] = [0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0];
const CLOSED_RAD: [f64; 7] = [0.0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3];

/// Parses a position `[x, y, z]`.
fn position_m(value: &Value) -> [f64; 3] {
    serde_json::from_value(value.clone()).expect("a position")
}

#[test]
fn the_bottle_is_lifted_by_what_the_tools_say() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let tool = |name: &str, args: Value| server.tool(&id, name, &args).ok();
    let seen = tool("observe", json!({ "robots": ["A"] }));
    let eye_m = position_m(&seen["cameras"][0]["camera_in_pelvis"]["position_m"]);
    let measured = tool("query_depth", json!({ "robot": "A", "pixels": [PIXEL] }));
    let surface_m = position_m(&json!(measured["points"][0].as_array().expect("a row")[2..]));

    // The pixel shows the surface; the axis is one radius behind it.
    let sight_m = [surface_m[0] - eye_m[0], surface_m[1] - eye_m[1]];
    let behind = 1.0 + BOTTLE_RADIUS_M / sight_m[0].hypot(sight_m[1]);
    let axis_m = [eye_m[0] + sight_m[0] * behind, eye_m[1] + sight_m[1] * behind];
    let mut last = Value::Null;
    for (offset_y_m, raise_m, fingers_rad, commands) in [
        (-0.135, 0.1, OPEN_RAD, 2),
        (-0.135, 0.0, OPEN_RAD, 2),
        (-0.055, 0.0, OPEN_RAD, 2),
        (-0.055, 0.0, CLOSED_RAD, 2),
        (-0.055, 0.08, CLOSED_RAD, 2),
    ] {
        let target_m = [axis_m[0] - 0.12, axis_m[1] + offset_y_m, surface_m[2] + raise_m];
        let hand = json!({
            "robot": "A", "right_position_m": target_m, "right_quaternion_wxyz": [1, 0, 0, 0],
            "right_fingers_rad": fingers_rad,
        });
        for _ in 0..commands {
            last = tool("move_wrists", json!({ "steps": 50, "robots": [hand] }));
        }
    }
    assert_eq!(last["phases"][0]["id"], "grasp_and_lift", "{last}");
    assert!(last["robots"][0]["right"]["position_error_m"].as_f64().is_some_and(|m| m < 0.01), "{last}");
}
