//! Tests of teleoperation in real time, with one WebSocket per operator. Messages move only the operator's
//! robot, time stops while an operator is absent, and the recording is verified.

use std::{
    net::TcpStream,
    time::{Duration, Instant},
};

use serde_json::{Value, json};
use tungstenite::{Message, WebSocket, client::IntoClientRequest};

use super::team::Team;

/// Client that drives robots like the teleoperation page.
pub struct DriversSocket {
    socket: WebSocket<TcpStream>,
    scene: Value,
    /// Latest row received.
    row: Vec<f32>,
}

/// Opens the socket with these headers. Returns the status of the response if the connection is refused.
fn ask_for(
    team: &Team,
    robots: &str,
    headers: &[(&'static str, String)],
) -> Result<WebSocket<TcpStream>, u16> {
    let address = format!("ws://{}/operate/drive?robots={robots}", team.server.address);
    let mut request = address.into_client_request().expect("a request");
    for (name, value) in headers {
        request.headers_mut().insert(*name, value.parse().expect("a header"));
    }
    let stream = TcpStream::connect(team.server.address).expect("a connection");
    let opened = tungstenite::client(request, stream.try_clone().expect("a stream"));
    // A short read timeout, since there may be no message yet.
    stream.set_read_timeout(Some(Duration::from_millis(15))).expect("a limit");
    match opened {
        Ok((socket, _)) => Ok(socket),
        Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
            Err(answer.status().as_u16())
        }
        Err(error) => panic!("{error}"),
    }
}

/// Returns the cookie given to the operator of robot number `robot`.
fn entered(team: &Team, robot: usize) -> String {
    let bearer = format!("Bearer {}", team.tokens[robot]);
    let headers = [("authorization", bearer.as_str()), ("content-type", "application/json")];
    let (status, given, _) = team.server.ask("POST", "/operate/enter", &headers, b"{}");
    let cookie = given["set-cookie"].to_str().expect("a cookie").to_owned();
    assert!(status == 204 && cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    cookie.split(';').next().expect("its value").to_owned()
}

impl DriversSocket {
    /// Signs in like the page, as the operator of robot number `robot`.
    pub fn open(team: &Team, robot: usize) -> DriversSocket {
        DriversSocket::open_for(team, &[robot])
    }

    /// Signs in as the operator of the first of these robots. The others stand still.
    fn open_for(team: &Team, robots: &[usize]) -> DriversSocket {
        let names: Vec<&str> = robots.iter().map(|robot| ["A", "B"][*robot]).collect();
        let cookies: Vec<String> = robots.iter().map(|robot| entered(team, *robot)).collect();
        let mut socket =
            ask_for(team, &names.join(","), &[("cookie", cookies.join("; "))]).expect("a socket");
        let message = loop {
            match socket.read() {
                Ok(Message::Binary(bytes)) => break bytes,
                Ok(_) => {}
                Err(tungstenite::Error::Io(_)) => {}
                Err(error) => panic!("{error}"),
            }
        };
        let size = u32::from_le_bytes(message[..4].try_into().expect("four bytes")) as usize;
        let scene = serde_json::from_slice(&message[4..4 + size]).expect("JSON");
        DriversSocket { socket, scene, row: Vec::new() }
    }

    pub fn say(&mut self, wrist_move: Value, go: bool) {
        let word = json!({ "move": wrist_move, "go": go }).to_string();
        self.socket.send(Message::text(word)).expect("a page that is heard");
    }

    /// Reads all messages received so far.
    pub fn read(&mut self) {
        loop {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => {
                    let number = |four: &[u8]| f32::from_le_bytes(four.try_into().expect("four bytes"));
                    self.row = bytes.chunks_exact(4).map(number).collect();
                    return;
                }
                Ok(_) => {}
                Err(tungstenite::Error::Io(_)) => return,
                Err(error) => panic!("{error}"),
            }
        }
    }

    pub fn step(&self) -> f32 {
        self.row.get(1).copied().unwrap_or_default()
    }

    /// Returns the position of a robot's right wrist in the robot's pelvis frame. It is accurate enough for a
    /// standing robot.
    fn wrist_m(&self, robot: usize) -> [f32; 3] {
        let robots = self.scene["robots"].as_array().expect("robots");
        let links = |robot: &Value| robot["links"].as_u64().expect("links") as usize * 7;
        let all_links: usize = robots.iter().map(links).sum();
        let before: usize = robots[..robot].iter().map(links).sum();
        let objects = self.scene["objects"].as_array().expect("objects").len() * 7;
        let parts = |robot: &Value| 1 + 7 + 4 + 2 * 23 + robot["joints"].as_array().expect("joints").len();
        let hand =
            5 + all_links + objects + robots[..robot].iter().map(parts).sum::<usize>() + 1 + 7 + 4 + 23;
        std::array::from_fn(|axis| self.row[hand + axis] - self.row[5 + before + axis])
    }
}

fn apart_m(one: [f32; 3], other: [f32; 3]) -> f32 {
    one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f32>().sqrt()
}

/// Sends the moves of both clients' robots at 50 Hz for `time`.
fn drive(pages: &mut [DriversSocket], moves: [Value; 2], time: Duration) {
    let began = Instant::now();
    while began.elapsed() < time {
        for (page, wrist_move) in pages.iter_mut().zip(&moves) {
            page.say(wrist_move.clone(), true);
            page.read();
        }
    }
}

#[test]
fn two_people_drive_in_real_time_and_the_recording_comes_to_the_same() {
    let team = Team::start(json!({ "patience_s": 600, "talk": true, "protocol": "agentic" }));
    let mut pages = [DriversSocket::open(&team, 0), DriversSocket::open(&team, 1)];
    let still = || json!({});
    drive(&mut pages, [still(), still()], Duration::from_millis(500));
    let before = [0, 1].map(|robot| pages[0].wrist_m(robot));
    let first = pages[0].step();
    let began = Instant::now();
    let reach = json!({ "carried": true, "right_position_m": [0.3, -0.2, 0.2], "right_fingers_rad": [0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3] });
    drive(&mut pages, [reach, still()], Duration::from_secs(2));
    let rate = f64::from(pages[0].step() - first) / 50.0 / began.elapsed().as_secs_f64();
    assert!(rate < 1.05, "the world runs at {rate} of real time");
    let moved = [0, 1].map(|robot| apart_m(before[robot], pages[0].wrist_m(robot)));
    assert!(moved[0] > 0.1 && moved[1] < 0.02, "{moved:?}");

    // B disconnects: time stops, and A receives the name of the robot for which the episode waits.
    let [mut a, b] = pages;
    drop(b);
    std::thread::sleep(Duration::from_millis(300));
    let told_to_wait = (0..100).any(|_| {
        a.say(json!({}), true);
        matches!(a.socket.read(), Ok(Message::Text(text)) if text.contains("waits") && text.contains("\"B\""))
    });
    assert!(told_to_wait);
    a.read();
    let stood = a.step();
    for _ in 0..20 {
        a.say(json!({}), true);
        a.read();
    }
    assert_eq!(a.step(), stood);
    // B reconnects, and time continues.
    let mut pages = [a, DriversSocket::open(&team, 1)];
    drive(&mut pages, [still(), still()], Duration::from_secs(1));
    assert!(pages[0].step() > stood + 5.0, "{} after {stood}", pages[0].step());
    drop(pages);
    let (result, _) = team.verified();
    assert!(
        result["extra_information"].as_array().is_some_and(|named| named.contains(&json!("third_person")))
    );
}

/// Programs drive over the same socket, with rows of joint targets or with setpoints of all motors. After
/// each command the server sends the robot's state, with the sensor readings of every physics step.
#[test]
fn a_program_drives_joints_and_motors_by_the_socket_and_is_told_the_state() {
    let team = Team::start(json!({ "patience_s": 0.05 }));
    let mut page = DriversSocket::open(&team, 0);
    let mut state_after = |word: Value, steps: usize| {
        let (began, mut states) = (Instant::now(), Vec::new());
        while states.len() < steps {
            assert!(began.elapsed() < Duration::from_secs(60), "no state comes");
            page.socket.send(Message::text(word.to_string())).expect("a program that is heard");
            let Ok(Message::Text(text)) = page.socket.read() else { continue };
            let told: Value = serde_json::from_str(&text).expect("JSON");
            assert_ne!(told["kind"], "refused", "{told}");
            if told["kind"] == "state" {
                states.push(told["state"].clone());
            }
        }
        states.pop().expect("a state")
    };
    let mut row = vec![0.0; 35];
    (row[28], row[34]) = (0.2, 0.75);
    let turned = state_after(json!({ "row": row, "go": true, "states": true }), 40);
    assert!((turned["joint_positions_rad"]["waist_yaw_joint"].as_f64().unwrap() - 0.2).abs() < 0.05);
    let samples = &turned["samples"]["gyro_rad_s"];
    assert_eq!(samples.as_array().map(Vec::len), Some(4), "{samples}");
    assert_eq!(turned["fallen"], false);
    let limp = state_after(json!({ "drives": vec![0.0; 215], "go": true, "states": true }), 100);
    assert_eq!(limp["fallen"], true, "nobody balances it");
    drop(page);
    let (result, _) = team.verified();
    let used = &result["operators"][0];
    assert!(used["thinking_s"].as_f64().expect("its thinking") < 1.0, "pacing is no thinking: {used}");
    let departures = result["departures"].as_array().expect("departures");
    assert!(departures.contains(&json!("control: joint (A)")), "{departures:?}");
}

/// The socket receives reports for the idle robot, too, before or after the reports for the operator's robot.
#[test]
fn a_person_beside_a_robot_that_nobody_drives_is_told_how_it_goes() {
    for robots in [[0, 1], [1, 0]] {
        let team = Team::start(json!({ "patience_s": 600 }));
        let own = ["A", "B"][robots[0]];
        let mut page = DriversSocket::open_for(&team, &robots);
        let began = Instant::now();
        loop {
            assert!(began.elapsed() < Duration::from_secs(60), "robot {own} is told nothing of itself");
            page.say(json!({}), true);
            let Ok(Message::Text(text)) = page.socket.read() else { continue };
            let told: Value = serde_json::from_str(&text).expect("JSON");
            assert_ne!(told["kind"], "refused", "{told}");
            if told["kind"] == "report" && told["report"]["robots"][0]["robot"] == own {
                break;
            }
        }
    }
}

#[test]
fn the_socket_opens_for_the_own_robot_and_for_pages_of_this_server() {
    let team = Team::start(json!({ "patience_s": 600 }));
    let cookie = |robot: &str, token: &str| ("cookie", format!("tandem_operator_{robot}={token}"));
    let own = cookie("A", &team.tokens[0]);
    let origin = |address: String| ("origin", address);
    let same = origin(format!("http://{}", team.server.address));
    assert!(ask_for(&team, "A", &[own.clone(), same]).is_ok());
    let check = |robots: &str, headers: &[(&'static str, String)], expected: u16| {
        assert_eq!(ask_for(&team, robots, headers).err(), Some(expected), "{robots} {headers:?}");
    };
    check("A", &[own.clone(), origin("http://evil.example".into())], 403);
    check("B", &[cookie("B", &team.tokens[0])], 403);
    check("A,B", &[own], 403);
    check("A", &[], 403);
    check("A", &[cookie("A", "0123456789abcdef0123456789abcdef01234567")], 403);
}
