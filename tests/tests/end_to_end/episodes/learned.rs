//! Tests of learned policies as clients: MessagePack, raw images, depth, and joint rows for one robot or all.

use serde::Deserialize;
use serde_json::{Value, json};
use tandem_tests::TestServer;
use tandem_tools_spec::{CameraCalibration, DepthRow};

const MSGPACK: &str = "application/msgpack";
const PIXELS: usize = 320 * 240;

/// Fields of a reply that a learned policy reads.
#[derive(Debug, Deserialize)]
struct StepReply {
    step: u32,
    observation: Observation,
}

#[derive(Debug, Deserialize)]
struct Observation {
    states: Vec<State>,
    #[serde(default)]
    images: Vec<Image>,
    arrays: Vec<Arrays>,
}

#[derive(Debug, Deserialize)]
struct Image {
    png: Vec<u8>,
}

#[derive(Debug, Deserialize)]
struct State {
    robot: String,
    joint_positions_rad: std::collections::BTreeMap<String, f64>,
}

#[derive(Debug, Deserialize)]
struct Arrays {
    robot: String,
    rgb: Option<Vec<u8>>,
    depth_float16: Option<Vec<u8>>,
    depth_png16: Option<Vec<u8>>,
}

/// Calls a tool with MessagePack and returns the raw response.
fn call(server: &TestServer, id: &str, tool: &str, args: &Value) -> (u16, Vec<u8>) {
    let path = format!("/v1/episodes/{id}/tools/{tool}");
    let body = rmp_serde::to_vec(args).expect("MessagePack");
    let (status, headers, bytes) = server.ask("POST", &path, &[("content-type", MSGPACK)], &body);
    let kind = if status == 200 { MSGPACK } else { "application/problem+json" };
    assert_eq!(headers["content-type"], kind);
    (status, bytes)
}

fn rows(robots: &[&str], steps: usize) -> Value {
    let mut row = vec![0.0; 35];
    row[34] = 0.75;
    let chunks = robots.iter().map(|robot| json!({ "robot": robot, "rows": vec![row.clone(); steps] }));
    json!(chunks.collect::<Vec<_>>())
}

#[test]
fn one_call_steps_and_returns_what_is_seen_then() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    for (robots, step) in [(&["A", "B"][..], 20), (&["B"], 40)] {
        let look = json!({ "images": "rgb", "depth": "float16" });
        let args = json!({ "robots": rows(robots, 20), "observe": look });
        let (status, bytes) = call(&server, &id, "send_joint_chunk", &args);
        assert_eq!(status, 200);
        let reply: StepReply = rmp_serde::from_slice(&bytes).expect("a reply");
        let seen = &reply.observation;
        assert_eq!((reply.step, seen.images.len(), seen.states[1].robot.as_str()), (step, 0, "B"));
        assert_eq!(seen.states[0].joint_positions_rad.len(), 43);
        assert_eq!(seen.arrays.iter().map(|one| one.robot.as_str()).collect::<Vec<_>>(), ["A", "B"]);
        for one in &seen.arrays {
            assert_eq!(one.rgb.as_ref().map(Vec::len), Some(3 * PIXELS));
            assert_eq!(one.depth_float16.as_ref().map(Vec::len), Some(2 * PIXELS));
            assert_eq!(one.depth_png16, None);
        }
    }
}

/// Returns the coordinate along the camera's optical axis of a point given in the pelvis frame.
fn along_axis_m(camera: &CameraCalibration, point_m: [f64; 3]) -> f64 {
    let tandem_tools_spec::Pose { position_m, quaternion_wxyz: [w, x, y, z] } = camera.camera_in_pelvis;
    let axis = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)];
    (0..3).map(|i| axis[i] * (point_m[i] - position_m[i])).sum()
}

#[test]
fn every_form_says_the_same() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let see = |fields: Value| server.tool(&id, "observe", &fields).ok();
    let raw = see(json!({ "robots": ["A"], "images": "rgb", "depth": "png16" }));
    assert!(raw.get("images").is_none(), "the arrays have them");
    let depth = raw["arrays"][0]["depth_png16"].as_str().expect("base64");
    assert!(depth.starts_with("iVBORw0KGgo"));
    let both = see(json!({ "robots": ["A"], "images": "png", "depth": "float16" }));
    assert!(both["images"][0]["png_base64"].as_str().is_some_and(|png| png.starts_with("iVBORw0KGgo")));
    assert!(both["arrays"][0].get("rgb").is_none());

    let (_, bytes) = call(&server, &id, "observe", &json!({ "robots": ["A"], "depth": "float16" }));
    let seen: Observation = rmp_serde::from_slice(&bytes).expect("an observation");
    assert!(seen.images[0].png.starts_with(b"\x89PNG"));
    let depth = seen.arrays[0].depth_float16.as_ref().expect("depth");
    let pixels: [[usize; 2]; 3] = [[160, 120], [10, 230], [300, 200]];
    let measured = server.tool(&id, "query_depth", &json!({ "robot": "A", "pixels": pixels })).ok();
    let camera: CameraCalibration = serde_json::from_value(raw["cameras"][0].clone()).expect("a calibration");
    for ([u, v], row) in pixels.into_iter().zip(measured["points"].as_array().expect("points")) {
        let at = 2 * (v * 320 + u);
        let depth_m = half(u16::from_le_bytes([depth[at], depth[at + 1]]));
        let row: DepthRow = serde_json::from_value(row.clone()).expect("a row");
        let expected_m = along_axis_m(&camera, row.point_m().expect("a point"));
        // The positions in these rows are rounded to the millimetre.
        assert!((depth_m - expected_m).abs() < 1e-3 * expected_m + 0.001, "{depth_m} {expected_m}");
    }
    let result = server.delete(&format!("/v1/episodes/{id}")).ok();
    // Information that the benchmark withholds, and the number of replies with it.
    let shown = ["depth_images", "pixel_depth", "joint_velocities", "joint_torques", "odometry", "gravity"];
    assert_eq!(result["extra_information"], json!(shown));
    let replies = &result["extra_information_replies"];
    assert_eq!(
        (&replies["pixel_depth"], &replies["depth_images"]["A"]),
        (&json!({ "A": 1 }), &replies["odometry"]["A"])
    );
}

/// Decodes a positive normal half-precision number.
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10), f64::from(bits & 0x3ff));
    (1.0 + fraction / 1024.0) * f64::from(exponent - 15).exp2()
}

#[test]
fn agents_get_no_depth_images() {
    let server = TestServer::start();
    let id = server.episode("agentic");
    let depth = json!({ "robots": ["A"], "depth": "float16" });
    server.tool(&id, "observe", &depth).refused(409, &["query_depth", "benchmark protocol"]);
    server.tool(&id, "wait", &json!({ "steps": 5, "observe": depth })).refused(409, &["query_depth"]);
    assert_eq!(server.get(&format!("/v1/episodes/{id}")).ok()["step"], 300);
    server.tool(&id, "observe", &json!({ "robots": ["A"], "images": "rgb" })).ok();
}

#[test]
fn either_form_may_be_written_and_read() {
    let server = TestServer::start();
    let start = json!({ "task": "handover", "seed": 0, "protocol": "benchmark" });
    let body = rmp_serde::to_vec(&start).expect("MessagePack");
    let headers = [("content-type", MSGPACK), ("accept", "application/json")];
    let (status, headers, bytes) = server.ask("POST", "/v1/episodes", &headers, &body);
    assert_eq!((status, &headers["content-type"]), (201, &"application/json".parse().expect("a type")));
    let started: Value = serde_json::from_slice(&bytes).expect("JSON");
    let id = started["episode_id"].as_str().expect("an id");
    let accept = [("accept", MSGPACK)];
    let (_, headers, bytes) = server.ask("GET", &format!("/v1/episodes/{id}"), &accept, b"");
    let status: Value = rmp_serde::from_slice(&bytes).expect("MessagePack");
    assert_eq!((&headers["content-type"], &status["step"]), (&MSGPACK.parse().expect("a type"), &json!(0)));

    for (args, code, says) in [
        (b"\x81\xa5steps".to_vec(), 400, "no MessagePack"),
        (rmp_serde::to_vec(&json!({ "steps": 0 })).expect("MessagePack"), 422, "at least 1"),
        (vec![0x91; 100_000], 400, "no MessagePack"),
    ] {
        let path = format!("/v1/episodes/{id}/tools/wait");
        let (status, _, bytes) = server.ask("POST", &path, &[("content-type", MSGPACK)], &args);
        let text = String::from_utf8_lossy(&bytes);
        assert!(status == code && text.contains(says), "{status}: {text}");
    }
}
