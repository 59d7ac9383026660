//! Goldens of all refusals as callers receive them, so that changes of code show as changes of responses.
//!
//! `UPDATE_EXPECT=1 cargo test --workspace --release --lib goldens` rewrites the file.

use std::{env, fs, io, path::Path, sync::Arc, time::Duration};

use axum::{
    body::to_bytes,
    http::{HeaderName, StatusCode, header},
    response::IntoResponse,
};
use serde_json::{Value, json};
use tandem_episodes::{
    CheckpointError, EpisodeError, OutputError, RobotError, SceneError, SimError, players::PlayerError,
};
use tandem_tools_spec::{Color, EndReason, ResultReply, SpecError, SurfaceQuery};

use super::ApiError;
use crate::{hosting::HostingError, token::TokenError};

fn failure() -> io::Error {
    io::Error::other("disk full")
}

fn own_refusals() -> Vec<ApiError> {
    let no_route = |other_method| ApiError::NoRoute {
        method: "PUT".into(),
        path: "/v1/x".into(),
        have: vec!["GET /healthz".into(), "POST /mcp".into()],
        other_method,
    };
    vec![
        no_route(false),
        no_route(true),
        ApiError::EpisodeMismatch { path: "a".into(), body: "\"b\"".into() },
        ApiError::NoEpisodeNamed { tool: "wait".into() },
        ApiError::ForeignHost("evil.example".into()),
        ApiError::ForeignOrigin("http://evil.example".into()),
        ApiError::NotEncrypted,
        ApiError::MalformedJson("expected value at line 1".into()),
        ApiError::MalformedMsgpack("it ends too early".into()),
        ApiError::NoToken,
        ApiError::NoWatcher,
        ApiError::NoRun { run: "expert/handover-seed0".into() },
        ApiError::NoTexture { hash: "0123".into() },
        ApiError::NoCollection,
        ApiError::NothingToMark,
        ApiError::Key,
        ApiError::NoObject("a number"),
        ApiError::SlowBody { limit: Duration::from_secs(30) },
        ApiError::BrokenBody("connection reset".into()),
        ApiError::BodyTooLarge { limit_bytes: 2_000_000 },
        ApiError::ContentType("text/plain".into()),
        ApiError::Busy { limit: 256 },
        ApiError::TooManyRequests { per_second: 10 },
        ApiError::UnknownFormat { name: "yaml".into() },
        ApiError::Protocol { status: StatusCode::BAD_REQUEST, detail: "the path is no text".into() },
        ApiError::Protocol { status: StatusCode::UNPROCESSABLE_ENTITY, detail: "no query".into() },
        ApiError::Reply(failure().into()),
        ApiError::RecordingFailed {
            error: Box::new(HostingError::TooManyWaiting { limit: 16 }.into()),
            recording_failed: "disk full".into(),
        },
    ]
}

fn hosting_refusals() -> Vec<HostingError> {
    let robot = || "A".to_owned();
    vec![
        HostingError::UnknownEpisode { id: "x".into() },
        HostingError::NoImage { name: "7-A.png".into(), kept: 24 },
        HostingError::TooManyEpisodes { limit: 8 },
        HostingError::TooManyWaiting { limit: 16 },
        HostingError::ShuttingDown,
        HostingError::HeldAlready { id: "handover-seed0".into() },
        HostingError::EpisodeStopped,
        HostingError::EpisodePanicked,
        EpisodeError::OtherStep { expected: 1, now: 2 }.into(),
        HostingError::DoubleCommand { robot: robot(), waits_for: vec!["B".into(), "C".into()] },
        HostingError::DoubleCommand { robot: robot(), waits_for: Vec::new() },
        HostingError::LateCommand { robot: robot(), from_step: 1, to_step: 9 },
        HostingError::OperatorFinished { robot: robot() },
        HostingError::OperatorOutOfTime { robot: robot(), limit_s: 1800 },
        HostingError::NeedsOperator,
        HostingError::HostsBusiness,
        HostingError::OneEpisode,
        HostingError::PeopleDrive,
        HostingError::OnePolicy,
        HostingError::NoExpert(PlayerError::NoExpert { task: "x".into(), have: vec!["handover"] }),
        HostingError::NoPolicy { reason: "nobody listens at http://127.0.0.1:1/act".into() },
        HostingError::NoTalk,
        HostingError::TooMuchSaid { robot: robot(), unheard: 8 },
        HostingError::KeyUsed,
        HostingError::Token(TokenError::Form { place: "the environment".into() }),
        HostingError::Thread(failure()),
        HostingError::Shared(Arc::new(HostingError::TooManyEpisodes { limit: 8 })),
        HostingError::Shared(Arc::new(HostingError::EpisodeStopped)),
    ]
}

fn result() -> ResultReply {
    let result = serde_json::json!({
        "task": "handover", "seed": 0, "protocol": "agentic", "phases": { "p1": 9.62, "p2": null, "p3": null },
        "ended": "finished", "env_steps": 890, "tool_calls": 60, "falls": 0, "realtime_factor": 60.0,
        "state_hash": "7ae670852d40c288",
    });
    serde_json::from_value(result).expect("a result")
}

fn episode_refusals() -> Vec<EpisodeError> {
    vec![
        EpisodeError::UnknownTask { id: "x".into(), have: vec!["handover".into()] },
        EpisodeError::UnknownRobot { name: "Z".into(), have: vec!["A".into(), "B".into()] },
        EpisodeError::ForeignRobot { name: "B".into(), own: "A".into() },
        EpisodeError::DepthImage { protocol: "agentic" },
        EpisodeError::TooManySteps { asked: 60, most: 25, protocol: "agentic" },
        EpisodeError::NoDepth { u: 10, v: 20 },
        EpisodeError::NoSurface {
            query: SurfaceQuery { pixel: None, color: Some(Color::Red), object: None },
            seen: vec![Color::Blue, Color::White],
        },
        EpisodeError::NoSurface {
            query: SurfaceQuery { pixel: None, color: None, object: Some("bottle".into()) },
            seen: Vec::new(),
        },
        EpisodeError::PixelOutside { u: 320, v: 0, width: 320, height: 240 },
        EpisodeError::Ended { reason: EndReason::Finished, result: result().into() },
        EpisodeError::Sim(SimError::WithoutGpu),
        EpisodeError::from(SceneError::Tilted { path: "s.xml".into(), site: "task".into(), tilt_deg: 3.0 }),
        EpisodeError::from(RobotError::NoFingers { task: "handover".into(), robot: "walker".into() }),
        CheckpointError::NoPhase { path: "c".into(), phase: "p2".into() }.into(),
        EpisodeError::Build(failure()),
        OutputError::Io { path: "runs".into(), source: failure() }.into(),
    ]
}

fn spec_refusals() -> Vec<SpecError> {
    vec![
        SpecError::UnknownTool { name: "fly".into(), have: vec!["wait", "walk"] },
        SpecError::Malformed {
            tool: "wait",
            place: "steps: ".into(),
            reason: "no number".into(),
            example: "{}".into(),
        },
        SpecError::Invalid { tool: "wait", reason: "steps is 0".into() },
    ]
}

async fn served(error: ApiError) -> Value {
    let response = error.into_response();
    let names = [header::CONTENT_TYPE, header::RETRY_AFTER, header::WWW_AUTHENTICATE, header::CONNECTION];
    let header =
        |name: &HeaderName| Some(format!("{name}: {}", response.headers().get(name)?.to_str().unwrap()));
    let headers: Vec<String> = names.iter().filter_map(header).collect();
    let status = response.status().as_u16();
    let body = to_bytes(response.into_body(), usize::MAX).await.unwrap();
    json!({ "status": status, "headers": headers, "body": String::from_utf8(body.into()).unwrap() })
}

#[tokio::test]
async fn every_refusal_is_served_as_its_golden_has_it() {
    let hosting = hosting_refusals().into_iter().map(ApiError::from);
    let episode = episode_refusals().into_iter().map(|error| HostingError::from(error).into());
    let within =
        spec_refusals().into_iter().map(|error| HostingError::from(EpisodeError::from(error)).into());
    let spec = spec_refusals().into_iter().map(ApiError::from);
    let mut all = Vec::new();
    for error in own_refusals().into_iter().chain(hosting).chain(episode).chain(within).chain(spec) {
        all.push(served(error).await);
    }
    let text = serde_json::to_string_pretty(&all).unwrap() + "\n";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/http/problem/goldens.json");
    if env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&path, &text).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    let differs = kept.lines().zip(text.lines()).find(|(kept, now)| kept != now);
    assert!(
        kept == text,
        "what is served has changed at {differs:?}; if that is meant, write the golden anew with UPDATE_EXPECT=1"
    );
}
