//! Tests of viewers: they need only the link, receive the episode, and have no effect on it.

use std::collections::BTreeSet;
use std::net::TcpStream;
use std::sync::Mutex;

use serde_json::{Value, json};
use tandem::{settings::Layer, token::Token};
use tandem_episodes::{Recorder, Recording, players, replay};
use tandem_evaluation::evaluation::evaluate;
use tandem_tests::TestServer;
use tandem_tools_spec::Png;
use tungstenite::{Message, WebSocket, client::IntoClientRequest};

use crate::policies::plans::{plan, play};

const TOKEN: &str = "correct-horse-battery-staple";
/// Scene of Handover in a kitchen with textured surfaces.
const KITCHEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../episodes/tests/scenes/kitchen/handover.xml");
/// Scene of Handover on a block of one colour.
const BLOCK: &str = r#"<mujoco model="block"><worldbody>
  <geom type="plane" size="3 3 0.1" rgba="0.5 0.5 0.5 1"/>
  <geom type="box" pos="0.37 0 0.78" size="0.2 0.5 0.02" rgba="0.7 0.6 0.5 1"/>
  <site name="task"/>
</worldbody></mujoco>"#;

/// Returns calls of 0.1 s each that move both robots.
fn calls() -> Vec<(&'static str, Value)> {
    let move_wrists =
        json!({ "steps": 5, "robots": [{ "robot": "A", "right_position_m": [0.25, -0.2, 0.2] }] });
    vec![
        ("wait", json!({ "steps": 5 })),
        ("move_wrists", move_wrists),
        ("observe", json!({ "robots": ["B"] })),
    ]
}

fn watch(server: &TestServer, id: &str) -> WebSocket<TcpStream> {
    let address = format!("ws://{}/watch/live?episode={id}", server.address);
    let mut request = address.into_client_request().expect("a request");
    let cookie = format!("tandem_watch={}", server.watch_key());
    request.headers_mut().insert("cookie", cookie.parse().expect("a cookie"));
    let stream = TcpStream::connect(server.address).expect("a connection");
    tungstenite::client(request, stream).expect("a socket").0
}

/// Requests a page with the key from the viewers' link.
fn get(server: &TestServer, path: &str) -> (u16, Vec<u8>) {
    let key = format!("Bearer {}", server.watch_key());
    let (status, _, bytes) = server.ask("GET", path, &[("authorization", &key)], b"");
    (status, bytes)
}

/// Returns the header of a scene's message, and the numbers of its frames.
fn scene(message: &[u8]) -> (Value, Vec<f32>) {
    let size = u32::from_le_bytes(message[..4].try_into().expect("four bytes")) as usize;
    let head: Value = serde_json::from_slice(&message[4..4 + size]).expect("JSON");
    let meshes = head["meshes"].as_array().expect("meshes");
    let bytes = meshes.iter().map(|mesh| {
        let [vertices, triangles, has_uvs] = [0, 1, 2].map(|at| mesh[at].as_u64().unwrap_or_default());
        (16 + 8 * has_uvs) * vertices + 12 * triangles
    });
    let begin = 4 + size + bytes.sum::<u64>() as usize;
    (head, numbers(&message[begin..]))
}

fn numbers(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().expect("four bytes"))).collect()
}

#[test]
fn who_has_not_come_by_the_link_sees_nothing() {
    let inside = [
        "/watch/episodes",
        "/watch/scene?episode=handover-seed0",
        "/watch/live?episode=handover-seed0",
        "/watch/page.js",
    ];
    let open = TestServer::start();
    open.episode("benchmark");
    let closed = TestServer::with(Layer {
        token: Some(Token::parse(TOKEN, "a test").expect("a token")),
        ..Layer::default()
    });
    let policy = format!("Bearer {TOKEN}");
    for path in inside {
        open.get(path).refused(403, &["link", "printed"]);
        let (status, _, _) = closed.ask("GET", path, &[("authorization", &policy)], b"");
        assert_eq!(status, 403, "a policy's token opens {path}");
        assert_eq!(closed.get(path).status, 401, "{path}");
        let forged = [("cookie", "tandem_watch=0123456789abcdef0123456789abcdef01234567")];
        assert_eq!(closed.ask("GET", path, &forged, b"").0, 401, "{path}");
    }
    let (status, _, door) = closed.ask("GET", "/v1/episodes", &[("accept", "text/html")], b"");
    assert!(status == 401 && String::from_utf8_lossy(&door).contains("open the link"), "{status}");
    let (_, _, door) = open.ask("GET", "/watch", &[], b"");
    assert!(!String::from_utf8_lossy(&door).contains("handover"));
}

#[test]
fn the_link_becomes_a_cookie_that_opens_pages_and_nothing_else() {
    let server = TestServer::with(Layer {
        token: Some(Token::parse(TOKEN, "a test").expect("a token")),
        ..Layer::default()
    });
    let key = format!("Bearer {}", server.watch_key());
    let (status, headers, _) = server.ask("POST", "/watch", &[("authorization", &key)], b"");
    let cookie = headers["set-cookie"].to_str().expect("a text");
    assert!(status == 204 && cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    let cookie = cookie.split(';').next().expect("a cookie");
    let (status, headers, page) = server.ask("GET", "/watch", &[("cookie", cookie)], b"");
    assert_eq!(status, 200);
    assert!(String::from_utf8_lossy(&page).contains("/watch/page.js"));
    let policy = headers["content-security-policy"].to_str().expect("a text");
    assert!(
        policy.starts_with("default-src 'none'; script-src 'self'") && !policy.contains("unsafe"),
        "{policy}"
    );
    for path in ["/v1/episodes", "/metrics", "/", "/watcher"] {
        assert_eq!(server.ask("GET", path, &[("cookie", cookie)], b"").0, 401, "{path}");
        assert_eq!(server.ask("GET", path, &[("authorization", &key)], b"").0, 401, "{path}");
    }
    let evil = [("cookie", cookie), ("origin", "http://evil.example")];
    assert_eq!(server.ask("GET", "/watch/episodes", &evil, b"").0, 403, "another site's page");
}

#[test]
fn who_watches_sees_steps_calls_and_pictures_until_the_end() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let (status, message) = get(&server, &format!("/watch/scene?episode={id}"));
    assert_eq!(status, 200);
    let (head, first) = scene(&message);
    assert_eq!((&head["task"], &head["robots"][1]["name"]), (&json!("handover"), &json!("B")));
    assert_eq!((first[0], first[1]), (1.0, 0.0), "a step, the one before the first");
    let mut socket = watch(&server, &id);
    for (tool, args) in calls() {
        server.tool(&id, tool, &args).ok();
    }
    server.delete(&format!("/v1/episodes/{id}")).ok();
    let (mut steps, mut tools, mut pictures, mut ended) = (Vec::new(), Vec::new(), 0, None);
    let mut lacks = Vec::new();
    while let Ok(message) = socket.read() {
        match message {
            Message::Binary(bytes) => {
                let row = numbers(&bytes[..bytes.len().min(12)]);
                match row[0] {
                    1.0 => {
                        assert_eq!(bytes.len(), 4 * first.len(), "every step has the same numbers");
                        steps.push(row[1]);
                    }
                    _ => {
                        assert_eq!(row, [2.0, 3.0, 1.0], "a picture of the third call, by the second robot");
                        assert!(bytes[12..].starts_with(b"\x89PNG"));
                        pictures += 1;
                    }
                }
            }
            Message::Text(text) => {
                let told: Value = serde_json::from_str(&text).expect("JSON");
                match told["kind"].as_str() {
                    Some("call") => tools.push(told["tool"].clone()),
                    Some("next_phase") => lacks.push(told["phase"]["lacks"][0].clone()),
                    Some("ended") => ended = Some(told["result"]["ended"].clone()),
                    other => panic!("{other:?}"),
                }
            }
            Message::Close(_) => break,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(
        steps,
        [0.0, 2.0, 4.0, 5.0, 6.0, 8.0, 10.0, 10.0],
        "every other step, the last of each call, and the last"
    );
    assert_eq!((tools, pictures), (vec![json!("wait"), json!("move_wrists"), json!("observe")], 1));
    assert_eq!(ended, Some(json!("finished")));
    let first = "A's right hand does not hold bottle: the right one is off it";
    assert!(lacks.len() > 1 && lacks.iter().all(|lack| lack == first), "{lacks:?}");
}

#[test]
fn who_asks_whether_anybody_is_there_is_answered() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let mut socket = watch(&server, &id);
    for payload in ["there?", "", "still?"] {
        socket.send(Message::Ping(payload.into())).expect("a ping");
        let pong = std::iter::from_fn(|| Some(socket.read().expect("an open socket"))).find(Message::is_pong);
        assert_eq!(pong, Some(Message::Pong(payload.into())));
    }
    server.tool(&id, "wait", &json!({ "steps": 5 })).ok();
    let mut messages = std::iter::from_fn(|| Some(socket.read().expect("an open socket")));
    assert!(messages.any(|message| message.is_binary()), "a step is told as before");
    socket.close(None).expect("a close");
    let last = std::iter::from_fn(|| socket.read().ok()).last();
    assert!(last.is_some_and(|message| message.is_close()), "a close is answered by another");
}

#[test]
fn watching_changes_nothing() {
    let play = |watchers: usize| {
        let server = TestServer::start();
        let id = server.episode("benchmark");
        // The viewers do not read the data that is sent to them. The episode does not wait for viewers.
        let sockets: Vec<_> = (0..watchers).map(|_| watch(&server, &id)).collect();
        for (tool, args) in (0..8).flat_map(|_| calls()) {
            server.tool(&id, tool, &args).ok();
            if watchers > 0 {
                assert_eq!(get(&server, &format!("/watch/camera?episode={id}&robot=A")).0, 200);
            }
        }
        let result = server.delete(&format!("/v1/episodes/{id}")).ok();
        drop(sockets);
        (result["state_hash"].clone(), result["tool_calls"].clone(), result["phases"].clone())
    };
    let alone = play(0);
    assert_eq!(play(3), alone);
    assert_eq!(alone.1, 24);
}

#[test]
fn an_episode_that_has_ended_is_among_the_finished_while_it_is_held() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let listed = || {
        let list: Value = serde_json::from_slice(&get(&server, "/watch/episodes").1).expect("JSON");
        (list["held"][0]["ended"].clone(), list["finished"][0]["run"].clone())
    };
    assert_eq!(listed(), (Value::Null, Value::Null));
    server.tool(&id, "finish", &json!({})).ok();
    assert_eq!(listed(), (json!("finished"), json!(id)));
}

#[test]
fn a_finished_episode_can_be_looked_at_again() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    for (tool, args) in calls() {
        server.tool(&id, tool, &args).ok();
    }
    let seen = get(&server, &format!("/watch/camera?episode={id}&robot=B"));
    server.delete(&format!("/v1/episodes/{id}")).ok();
    let list: Value = serde_json::from_slice(&get(&server, "/watch/episodes").1).expect("JSON");
    assert_eq!((&list["held"], &list["finished"][0]["run"]), (&json!([]), &json!(id)));
    let (status, message) = get(&server, &format!("/watch/run?run={id}"));
    assert_eq!(status, 200);
    let (head, frames) = scene(&message);
    assert_eq!((&head["frames"], &head["result"]["env_steps"]), (&json!(3), &json!(10)));
    let length = frames.len() / 3;
    assert_eq!([0, 1, 2].map(|frame| frames[frame * length + 1]), [0.0, 5.0, 10.0]);
    let story = head["story"].as_array().expect("what happened");
    assert_eq!(story.len(), 3);
    assert_eq!((&story[2]["number"], &story[2]["seen"]), (&json!(3), &json!(["B"])));
    let again = get(&server, &format!("/watch/camera?run={id}&robot=B&time_s=0.2"));
    let room = get(&server, &format!("/watch/camera?run={id}&robot=third_person&time_s=0.2"));
    assert!(room.0 == 200 && room.1.starts_with(b"\x89PNG") && room != again);
    assert!(again == seen && again.0 == 200, "the robot's picture is the same, live and drawn again");
    let (status, film) = get(&server, &format!("/watch/film?run={id}"));
    assert!(status == 200 && film.starts_with(b"RIFF"));
    assert_eq!(get(&server, &format!("/watch/file?run={id}&file=result.json")).0, 200);
    let (status, problem) = get(&server, &format!("/watch/camera?run={id}&robot=Z"));
    assert!(status == 422 && String::from_utf8_lossy(&problem).contains("A, B"), "{status}");
    for wrong in [
        "run=..",
        "run=",
        "run=/etc",
        "run=nope",
        &format!("run={id}/../{id}"),
        &format!("run={id}&file=../x"),
    ] {
        assert_eq!(get(&server, &format!("/watch/file?{wrong}")).0, 404, "{wrong}");
    }
}

#[test]
fn people_take_over_from_a_moment_of_a_finished_episode() {
    let token = Token::parse(TOKEN, "a test").expect("a token");
    let server = TestServer::with(Layer { token: Some(token), ..Layer::default() });
    let host = format!("Bearer {TOKEN}");
    let ask = |method: &str, path: &str, bearer: &str, body: &Value| {
        let headers = [
            ("content-type", "application/json"),
            ("authorization", bearer),
            ("cookie", &format!("tandem_watch={}", server.watch_key())),
        ];
        let (status, _, bytes) = server.ask(method, path, &headers, body.to_string().as_bytes());
        (status, serde_json::from_slice::<Value>(&bytes).unwrap_or_default())
    };
    let started = ask(
        "POST",
        "/v1/episodes",
        &host,
        &json!({ "task": "handover", "seed": 0, "protocol": "benchmark" }),
    );
    let id = started.1["episode_id"].as_str().expect("an id").to_owned();
    for (tool, args) in calls() {
        assert_eq!(ask("POST", &format!("/v1/episodes/{id}/tools/{tool}"), &host, &args).0, 200);
    }
    ask("DELETE", &format!("/v1/episodes/{id}"), &host, &json!({}));
    let wanted = json!({ "run": id, "time_s": 0.2, "protocol": "agentic" });
    let watcher = format!("Bearer {}", server.watch_key());
    assert_eq!(
        ask("POST", "/watch/take_over", &watcher, &wanted).0,
        401,
        "the link for watching starts nothing"
    );
    let (status, over) = ask("POST", "/watch/take_over", &host, &wanted);
    assert_eq!((status, over["operators"].as_array().map(Vec::len)), (200, Some(2)), "{over}");
    let own = format!("Bearer {}", over["operators"][0]["token"].as_str().expect("a token"));
    let id = over["episode_id"].as_str().expect("an id");
    let state =
        ask("POST", &format!("/v1/episodes/{id}/tools/get_robot_state"), &own, &json!({ "robot": "A" })).1;
    let x_m = state["right_wrist"]["position_m"][0].as_f64().expect("a number");
    assert!(x_m > 0.1, "the hand has begun to reach out by then: {state}");
    let (status, result) = ask("DELETE", &format!("/v1/episodes/{id}"), &host, &json!({}));
    assert_eq!((status, &result["env_steps"]), (200, &json!(0)), "the whole budget is ahead: {result}");
    let recording = Recording::read(&server.folder(id).join(Recorder::FILE_NAME)).expect("a whole recording");
    assert!(recording.spec.departures().contains(&"taken over at 0.2 s".to_owned()));
    assert_eq!(replay::verify(&recording).expect("a replay").outcome, replay::Verdict::Same);
    let wrong = json!({ "run": "nope", "time_s": 0.2, "protocol": "agentic" });
    assert_eq!(ask("POST", "/watch/take_over", &host, &wrong).0, 404);
}

#[test]
fn evaluations_in_the_runs_folder_are_listed_as_they_fill() {
    let server = TestServer::start();
    let folder = server.folder("evaluation");
    let list = || {
        serde_json::from_slice::<Value>(&get(&server, "/watch/episodes").1).expect("JSON")["evaluations"]
            .clone()
    };
    assert_eq!(list(), json!([]));
    play(&plan(players::find("idle").expect("a player"), vec![1, 2], false), &folder);
    let complete = list();
    let expected = json!({
        "folder": "evaluation", "policies": ["idle"], "tasks": ["handover"], "played": 2, "succeeded": 0, "excluded": 0,
        "planned": 2, "runs": false, "last_unix_s": complete[0]["last_unix_s"],
    });
    assert_eq!(complete, json!([expected]));
    // A finished evaluation is not listed as running, even if files are missing from its folder.
    std::fs::remove_file(folder.join("episodes/handover-2.json")).expect("a result");
    assert_eq!((&list()[0]["played"], &list()[0]["runs"]), (&json!(1), &json!(false)));
    let again = plan(players::find("idle").expect("a player"), vec![1, 2], false);
    let seen = Mutex::new(Vec::new());
    evaluate(&again, &folder, &|_| seen.lock().expect("a list").push(list()[0]["runs"].clone()))
        .expect("it is played");
    assert_eq!(*seen.lock().expect("a list"), [true, true]);
    assert_eq!(list()[0]["runs"], json!(false));

    // An evaluation whose process has ended is not listed as running either.
    let planned = folder.join("planned.json");
    std::fs::write(&planned, r#"{"episodes": 2, "left_out": 0, "state": "playing"}"#).expect("a file");
    assert_eq!(list()[0]["runs"], json!(false));
}

/// A page shows every fifth step; for an observation it shows the image that the policy received.
#[test]
fn what_a_policy_was_shown_is_drawn_again_bit_for_bit() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let mut shown = Vec::new();
    for steps in [3, 4, 6] {
        let reach = json!({ "robot": "A", "right_position_m": [0.25, -0.2, 0.02 * f64::from(steps)] });
        server.tool(&id, "move_wrists", &json!({ "steps": steps, "robots": [reach] })).ok();
        let seen = server.tool(&id, "observe", &json!({ "robots": ["A"] })).ok();
        let png = seen["images"][0]["png_base64"].as_str().expect("a picture").to_owned();
        shown.push((seen["time_s"].as_f64().expect("a time"), png));
    }
    server.delete(&format!("/v1/episodes/{id}")).ok();
    for (time_s, png) in shown {
        let (status, again) = get(&server, &format!("/watch/camera?run={id}&robot=A&time_s={time_s:.2}"));
        assert_eq!((status, Png(again).to_base64()), (200, png), "at {time_s} s");
    }
}

/// An agent's notes are shown as soon as the server receives them, and so are refused calls that do not reach
/// the episode.
#[test]
fn notes_and_refusals_are_seen_as_they_come() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let mut socket = watch(&server, &id);
    let body = json!({ "text": "I wait.", "kind": "thought" }).to_string();
    let headers = [("content-type", "application/json")];
    let path = format!("/v1/episodes/{id}/notes");
    assert_eq!(server.ask("POST", &path, &headers, body.as_bytes()).0, 204);
    server.tool(&id, "wait", &json!({ "steps": "two" })).refused(422, &[]);
    server.tool(&id, "wait", &json!({ "steps": 2 })).ok();
    server.delete(&format!("/v1/episodes/{id}")).ok();
    let mut told: Vec<Value> = Vec::new();
    while let Ok(message) = socket.read() {
        if let Message::Text(text) = message {
            told.push(serde_json::from_str(&text).expect("JSON"));
        }
    }
    let kinds: Vec<_> = told
        .iter()
        .map(|one| (one["kind"].as_str(), one["entry"].as_u64(), one["number"].as_u64()))
        .collect();
    let expected = [
        (Some("next_phase"), None, None),
        (Some("note"), Some(1), None),
        (Some("next_phase"), None, None),
        (Some("call"), Some(2), None),
        (Some("call"), Some(3), Some(1)),
        (Some("ended"), None, None),
    ];
    assert_eq!(kinds, expected);
    assert_eq!((&told[1]["note"]["text"], &told[3]["ok"]), (&json!("I wait."), &json!(false)));
}

/// Textures are requested by hash, once for all parts that show them and for all episodes in a scene.
#[test]
fn images_on_surfaces_are_sent_once() {
    let server = TestServer::with(Layer { scene: Some(KITCHEN.into()), ..Layer::default() });
    let ids = [server.episode("benchmark"), server.episode("benchmark")];
    let heads = ids.each_ref().map(|id| scene(&get(&server, &format!("/watch/scene?episode={id}")).1).0);
    let textures = heads[0]["textures"].as_array().expect("images");
    assert_eq!(heads[0]["textures"], heads[1]["textures"]);
    let hashes: BTreeSet<&str> = textures.iter().filter_map(|texture| texture["hash"].as_str()).collect();
    // The textures of floor, walls, island and mug, the grid, and the sky.
    assert_eq!((hashes.len(), textures.len()), (6, 6));
    let parts = heads[0]["parts"].as_array().expect("parts");
    let shown: Vec<u64> = parts.iter().filter_map(|part| part["image"]["texture"].as_u64()).collect();
    assert!(shown.len() >= 5 && shown.iter().collect::<BTreeSet<_>>().len() == 5, "{shown:?}");
    for texture in textures {
        let path = format!("/watch/texture?hash={}", texture["hash"].as_str().expect("a hash"));
        let key = format!("Bearer {}", server.watch_key());
        let (status, headers, bytes) = server.ask("GET", &path, &[("authorization", &key)], b"");
        assert_eq!(
            (status, &headers["cache-control"]),
            (200, &"private, max-age=31536000, immutable".parse().unwrap())
        );
        let pixels = image::load_from_memory(&bytes).expect("an image").into_rgb8();
        for (axis, mean) in texture["mean_rgb"].as_array().expect("a colour").iter().enumerate() {
            let sum: f64 = pixels.pixels().map(|pixel| f64::from(pixel.0[axis]) / 255.0).sum();
            let difference = sum / pixels.pixels().len() as f64 - mean.as_f64().expect("a number");
            assert!(difference.abs() < 0.01, "{path} has another colour than its scene tells: {difference}");
        }
        assert_eq!(server.ask("GET", &path, &[], b"").0, 403, "{path} is for watchers");
        let for_operators = path.replace("/watch", "/operate");
        assert_eq!(server.ask("GET", &for_operators, &[], b"").2, bytes, "an open server needs no token");
    }
    assert_eq!(get(&server, "/watch/texture?hash=0123").0, 404);
    server.delete(&format!("/v1/episodes/{}", ids[0])).ok();
    let (recorded, _) = scene(&get(&server, &format!("/watch/run?run={}", ids[0])).1);
    assert_eq!(recorded["textures"], heads[0]["textures"]);
}

#[test]
fn a_room_without_images_sends_none() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("block.xml");
    std::fs::write(&path, BLOCK).expect("a file");
    let server = TestServer::with(Layer { scene: Some(path), ..Layer::default() });
    let id = server.episode("benchmark");
    let (head, _) = scene(&get(&server, &format!("/watch/scene?episode={id}")).1);
    assert_eq!((&head["textures"], &head["sky"], &head["lights"]), (&json!([]), &Value::Null, &Value::Null));
    let parts = head["parts"].as_array().expect("parts");
    assert!(parts.len() > 100 && parts.iter().all(|part| part.get("image").is_none()));
    assert!(head["meshes"].as_array().expect("meshes").iter().all(|mesh| mesh.get(2).is_none()));
}
