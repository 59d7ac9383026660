//! Recordings of a real world, read back.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use foxglove::Decode;
use foxglove::messages::{CompressedImage, FrameTransforms, SceneUpdate};
use tandem_sim::render::RendererKind;
use tandem_sim::{
    ObjectPlacement, Pose, Robot, RobotCommand, RobotPlacement, Rotation, Vector, World, WorldSpec,
};
use tandem_tools_spec::{
    Assistance, Budget, EndReason, PhaseReached, PhaseTimes, Protocol, ResultReply, ToolCall,
};

use super::*;
use crate::commands::{Executed, RobotSheet};
use crate::observation::{Detail, Observer, TeamObservation};
use crate::scoring::Scores;
use crate::spec::EpisodeSpec;
use crate::tasks;

const STEPS: u32 = 10;
const THOUGHT: Duration = Duration::from_nanos(1_234_567_891);

fn world() -> World {
    let robot = |name: &str, x_m: f32, yaw_rad: f32| RobotPlacement {
        name: name.into(),
        position_m: [x_m, 0.0],
        yaw_rad,
    };
    let bottle = Pose::from_translation(Vector::new(0.0, 0.0, 1.0));
    let spec = WorldSpec {
        scene: "kitchen_084".into(),
        robots: vec![robot("A", -0.6, 0.0), robot("B", 0.6, std::f32::consts::PI)],
        objects: vec![ObjectPlacement {
            name: "bottle".into(),
            file: "bottle".into(),
            world_from_object: bottle,
        }],
    };
    World::new(&spec).unwrap()
}

fn spec() -> EpisodeSpec {
    EpisodeSpec::new(&tasks::find("handover").unwrap(), 7, Protocol::Agentic)
}

fn sheet(robot: &Robot) -> RobotSheet {
    RobotSheet {
        name: robot.name.clone(),
        model: robot.model.clone(),
        base_limits: robot.base_limits(),
        start_from_room: nalgebra::Isometry3::identity(),
    }
}

/// Returns the observation of robot A.
fn seen(world: &World) -> TeamObservation {
    let sheets: Vec<RobotSheet> = world.robots().iter().map(sheet).collect();
    let mut observer = Observer::new(&EpisodeSpec { renderer: RendererKind::Cpu, ..spec() }, world);
    observer.observe(&world.present().into(), &[0], &sheets.iter().collect::<Vec<_>>(), Detail::Full)
}

/// Returns a recorder, and the scores of the world's one object.
fn recorder(folder: &Path, world: &World) -> (Recorder, Scores) {
    let start = world.present();
    let scores = Scores::new(
        spec().task.phases.clone(),
        [("bottle", "bottle".into())].into_iter(),
        &world.robots()[0].model,
        &start,
    )
    .unwrap();
    let header = RecordingHeader {
        spec: spec(),
        locomotion: "balance".into(),
        renderer: "by hand".into(),
        build: "0.1.0+test".into(),
        robots: world.robots().iter().map(sheet).collect(),
        scores: scores.memory(),
        executes_otherwise: false,
    };
    (Recorder::create(folder, Visibility::Live, None, header, &start, world.state_hash()).unwrap(), scores)
}

fn moment(world: &World) -> CallMoment {
    let step = world.present();
    CallMoment { time_s: step.time_s, control_step: step.control_step, thought: THOUGHT }
}

fn hash(world: &World) -> String {
    state_hash_text(world.state_hash())
}

fn record_step(recorder: &mut Recorder, scores: &mut Scores, world: &mut World, commands: &[RobotCommand]) {
    let step = world.control_step(commands).unwrap();
    let budget = Budget {
        steps_left: 6000 - step.control_step as u32,
        wall_clock_left_s: Some(1800.0),
        steps_per_command: 25,
    };
    recorder
        .step(&step, &Executed::default(), world.state_hash(), &scores.update(&step).facts, budget)
        .unwrap();
}

/// Records `STEPS` steps, a phase, a refused call and an observation with an image.
fn record(folder: &Path) -> (World, PathBuf) {
    let mut world = world();
    let (mut recorder, mut scores) = recorder(folder, &world);
    let commands = [world.rest_command(0), world.rest_command(1)];
    for _ in 0..STEPS {
        record_step(&mut recorder, &mut scores, &mut world, &commands);
    }
    let time_s = world.present().time_s;
    recorder.phase(&PhaseReached { id: "grasp_and_lift".into(), number: "p1".into(), time_s }).unwrap();
    let wait = ToolCall::parse("wait", serde_json::json!({ "steps": 10 })).unwrap();
    recorder
        .tool_call(
            ToolCallRecord::new(
                moment(&world),
                CallerRecord::Policy,
                &wait.into(),
                CallOutcome::refused(&"no steps are left"),
            )
            .unwrap(),
        )
        .unwrap();
    let observe = ToolCall::parse("observe", serde_json::json!({ "robots": ["A"] })).unwrap();
    let seen = seen(&world);
    let record =
        ToolCallRecord::new(moment(&world), CallerRecord::Operator("A"), &observe.into(), (&seen).into());
    recorder.tool_call(record.unwrap()).unwrap();
    let path = recorder.finish(&result()).unwrap();
    (world, path)
}

fn result() -> ResultReply {
    ResultReply {
        task: "handover".into(),
        seed: Some(7),
        protocol: Protocol::Agentic,
        phases: PhaseTimes(vec![("p1".into(), Some(0.2))]),
        success: None,
        ended: EndReason::Finished,
        env_steps: STEPS,
        tool_calls: 2,
        requests: None,
        thinking_s: 0.0,
        operators: Vec::new(),
        falls: 0,
        realtime_factor: 4.0,
        state_hash: Some("0123456789abcdef".into()),
        simulator_failure: None,
        assistance: Assistance::Full,
        extra_information: vec![],
        extra_information_replies: Default::default(),
        joints_clamped_share: None,
        departures: vec![],
        recording_failed: None,
        usage: None,
    }
}

#[test]
fn a_recording_has_a_message_a_step_on_every_topic() {
    let folder = tempfile::tempdir().unwrap();
    let (world, path) = record(folder.path());
    assert_eq!(path, folder.path().join("episode.mcap"));
    let bytes = fs::read(&path).unwrap();

    let seen = seen(&world);
    let picture = seen.robots[0].view.picture.png().unwrap();
    let mut counts = BTreeMap::new();
    let mut last_ns = 0;
    let mut last_transforms = None;
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert!(message.log_time >= last_ns, "{} goes back in time", message.channel.topic);
        last_ns = message.log_time;
        let schema = message.channel.schema.as_ref().unwrap().name.clone();
        let count: &mut u32 = counts.entry((message.channel.topic.clone(), schema)).or_default();
        assert_eq!(message.sequence, *count);
        *count += 1;
        match message.channel.topic.as_str() {
            "/tf" => last_transforms = Some(FrameTransforms::decode(&*message.data).unwrap()),
            "/A/egocentric" => assert!(CompressedImage::decode(&*message.data).unwrap().data == *picture),
            "/tool_calls" => assert!(!String::from_utf8_lossy(&message.data).contains("base64")),
            _ => {}
        }
    }
    assert_eq!(last_ns, 200_000_000, "ten steps of 20 ms");

    let expected = [
        ("/A/action", "tandem.Action", STEPS),
        ("/A/base_command", "tandem.BaseCommand", STEPS),
        ("/A/egocentric", "foxglove.CompressedImage", 1),
        ("/A/egocentric/calibration", "foxglove.CameraCalibration", 1),
        ("/A/hands", "tandem.Hands", STEPS),
        ("/A/joint_states", "foxglove.JointStates", STEPS),
        ("/B/action", "tandem.Action", STEPS),
        ("/B/base_command", "tandem.BaseCommand", STEPS),
        ("/B/hands", "tandem.Hands", STEPS),
        ("/B/joint_states", "foxglove.JointStates", STEPS),
        ("/budget", "tandem.Budget", STEPS),
        ("/phases", "tandem.Phase", 1),
        ("/scene", "foxglove.SceneUpdate", 1),
        ("/steps", "tandem.Step", STEPS + 1),
        ("/tf", "foxglove.FrameTransforms", 1 + STEPS / 5),
        ("/tool_calls", "tandem.ToolCall", 2),
    ];
    let counts: Vec<_> =
        counts.iter().map(|((topic, schema), n)| (topic.as_str(), schema.as_str(), *n)).collect();
    assert_eq!(counts, expected);
    wrists_follow_from_transforms(&world, &last_transforms.unwrap());

    let metadata = metadata(&bytes);
    assert_eq!(metadata["episode"]["seed"], "7");
    assert_eq!(metadata["episode"]["protocol"], "agentic");
    assert_eq!(metadata["episode"]["locomotion"], "balance");
    assert_eq!(metadata["episode"]["renderer"], "by hand");
}

#[test]
fn a_recording_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let (world, path) = record(folder.path());
    let recording = Recording::read(&path).unwrap();
    assert_eq!(Recording::read(folder.path()).unwrap().path(), path);
    assert_eq!((recording.spec.clone(), recording.build.as_str()), (spec(), "0.1.0+test"));
    assert_eq!(recording.steps().last().unwrap().unwrap(), world.present());
    let last_hash = recording.state_hashes().last().unwrap().unwrap();
    assert_eq!(last_hash, (STEPS.into(), hash(&world)));
    assert_eq!(recording.phases().unwrap()[0].time_s, 0.2);
    let calls = recording.tool_calls().unwrap();
    assert!(calls.iter().all(|call| call.thought == THOUGHT));
    assert_eq!((calls[0].tool.as_str(), &calls[0].outcome), ("wait", &Err("no steps are left".into())));
    assert_eq!((calls[1].arguments["robots"][0].as_str(), calls[1].outcome.is_ok()), (Some("A"), true));
    assert_eq!((&calls[0].operator, &calls[1].operator), (&None, &Some("A".into())));
    assert_eq!(recording.result.clone().unwrap(), result());
    let transcript = recording.transcript().unwrap();
    let [TranscriptEntry::Call { call: wait, .. }, TranscriptEntry::Call { call: look, .. }] =
        &transcript[..]
    else {
        panic!("{transcript:?}");
    };
    assert_eq!((wait.control_step, wait.pictures.as_slice()), (STEPS.into(), &[][..]));
    assert_eq!(look.pictures, [ShownPicture { robot: "A".into(), width: 320, height: 240 }]);
}

/// Checks that the chain of recorded frames puts wrists and camera where the world measured them.
fn wrists_follow_from_transforms(world: &World, recorded: &FrameTransforms) {
    let pose = |child: &str| {
        let mut frame = child;
        let mut world_from_child = Pose::IDENTITY;
        while frame != "world" {
            let link = recorded.transforms.iter().find(|t| t.child_frame_id == frame).unwrap();
            let (t, q) = (link.translation.unwrap(), link.rotation.unwrap());
            let parent_from_frame = Pose::from_parts(
                Vector::new(t.x as f32, t.y as f32, t.z as f32),
                Rotation::from_xyzw(q.x as f32, q.y as f32, q.z as f32, q.w as f32),
            );
            world_from_child = parent_from_frame * world_from_child;
            frame = &link.parent_frame_id;
        }
        world_from_child
    };
    let step = world.present();
    for (index, robot) in ["A", "B"].into_iter().enumerate() {
        let moved = &step.robots[index];
        for (side, measured) in ["left", "right"].into_iter().zip(moved.sensed.pelvis_from_wrist) {
            let recorded = pose(&format!("{robot}/{side}_wrist_yaw_link"));
            let measured = moved.truth.world_from_pelvis() * measured;
            let error_m = (recorded.translation - measured.translation).length();
            assert!(error_m < 1e-4, "{robot} {side} wrist is {error_m} m off");
            assert!(recorded.rotation.angle_between(measured.rotation) < 2e-3);
        }
        let camera = moved.truth.world_from_camera;
        let optical = pose(&format!("{robot}/egocentric"));
        let forward = optical.rotation * Vector::Z;
        assert!((forward + camera.rotation * Vector::Z).length() < 1e-3, "an image's z axis looks forward");
    }
    let bottle = step.object("bottle").unwrap().world_from_object;
    // Rounded to 8 um along each axis.
    assert!((pose("bottle").translation - bottle.translation).length() < 7e-6);
}

fn metadata(bytes: &[u8]) -> BTreeMap<String, BTreeMap<String, String>> {
    let summary = mcap::Summary::read(bytes).unwrap().expect("a summary");
    let read = |index| mcap::read::metadata(bytes, index).unwrap();
    summary.metadata_indexes.iter().map(read).map(|m| (m.name, m.metadata)).collect()
}

/// Foxglove's reader of JSON Schema needs one plain type per field and follows no references.
#[test]
fn json_schemas_are_flat() {
    let folder = tempfile::tempdir().unwrap();
    let (_, path) = record(folder.path());
    let summary = mcap::Summary::read(&fs::read(path).unwrap()).unwrap().expect("a summary");
    let schemas: Vec<_> = summary.schemas.values().filter(|schema| schema.encoding == "jsonschema").collect();
    assert_eq!(schemas.len(), 7);
    for schema in schemas {
        let document: serde_json::Value = serde_json::from_slice(&schema.data).unwrap();
        for (field, value) in document["properties"].as_object().unwrap() {
            let text = value.to_string();
            assert!(value["type"].is_string() && !text.contains("$ref"), "{}.{field}: {text}", schema.name);
        }
        let required = document["required"].as_array().unwrap();
        assert!(!required.contains(&"wall_clock_left_s".into()), "the benchmark protocol has no wall clock");
    }
}

#[test]
fn an_interrupted_recording_never_gets_the_final_name() {
    let folder = tempfile::tempdir().unwrap();
    let mut world = world();
    let (mut recorder, mut scores) = recorder(folder.path(), &world);
    let commands = [world.rest_command(0), world.rest_command(1)];
    record_step(&mut recorder, &mut scores, &mut world, &commands);
    drop(recorder);
    assert!(!folder.path().join("episode.mcap").exists());

    let partial = fs::read(folder.path().join("episode.mcap.partial")).unwrap();
    let summary = mcap::Summary::read(&partial).unwrap().expect("the index is written nevertheless");
    assert_eq!(
        summary.stats.unwrap().message_count,
        13,
        "shapes, two steps, transforms, budget and four per robot"
    );
    let recording = Recording::read(&folder.path().join("episode.mcap.partial")).unwrap();
    assert_eq!((recording.steps().count(), recording.result), (2, None));
}

#[test]
fn the_scene_shows_every_drawn_geom() {
    let folder = tempfile::tempdir().unwrap();
    let (world, path) = record(folder.path());
    let bytes = fs::read(path).unwrap();
    let scene =
        mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).find(|m| m.channel.topic == "/scene");
    let update = SceneUpdate::decode(&*scene.unwrap().data).unwrap();
    assert_eq!(update.entities.len(), world.robots().iter().map(|r| r.model.links.len()).sum::<usize>());
    for entity in &update.entities {
        let (robot, link) = entity.frame_id.split_once('/').unwrap();
        let robot = world.robots().iter().find(|r| r.name == robot).unwrap();
        let link = robot.model.links.iter().find(|l| l.name == link).unwrap();
        let drawn = |wanted: fn(&tandem_sim::mjcf::Primitive) -> bool| {
            link.geoms.iter().filter(|geom| geom.drawn && wanted(&geom.primitive)).count()
        };
        use tandem_sim::mjcf::Primitive::*;
        assert_eq!(entity.cubes.len(), drawn(|p| matches!(p, Box { .. } | Plane { .. })), "{}", entity.id);
        assert_eq!(
            entity.cylinders.len(),
            drawn(|p| matches!(p, Cylinder { .. } | Capsule { .. })),
            "{}",
            entity.id
        );
        assert_eq!(entity.triangles.len(), drawn(|p| matches!(p, Convex { .. })), "{}", entity.id);
        assert_eq!(entity.models.len(), drawn(|p| matches!(p, Mesh(_))), "{}", entity.id);
        for list in &entity.triangles {
            assert!(list.indices.iter().all(|index| (*index as usize) < list.points.len()));
        }
    }
    let colours = |robot: &str| -> Vec<String> {
        let entities = update.entities.iter().filter(|entity| entity.id.starts_with(robot));
        entities.flat_map(|e| e.triangles.iter()).map(|t| format!("{:?}", t.color)).collect()
    };
    assert_ne!(colours("A/"), colours("B/"), "partners differ in colour");
}

/// Collects every text of a JSON value.
fn texts(value: &serde_json::Value, found: &mut Vec<String>) {
    match value {
        serde_json::Value::String(text) => found.push(text.clone()),
        serde_json::Value::Array(values) => values.iter().for_each(|value| texts(value, found)),
        serde_json::Value::Object(fields) => fields.values().for_each(|value| texts(value, found)),
        _ => {}
    }
}

/// The Foxglove layout in the book names only topics that recordings contain.
#[test]
fn the_layout_names_topics_and_fields_that_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let (_, path) = record(folder.path());
    let summary = mcap::Summary::read(&fs::read(path).unwrap()).unwrap().expect("a summary");
    let layout: serde_json::Value = serde_json::from_str(include_str!("../../foxglove_layout.json")).unwrap();
    let mut named = Vec::new();
    texts(&layout["configById"], &mut named);
    named.extend(layout["configById"]["3D!room"]["topics"].as_object().unwrap().keys().cloned());
    let paths: Vec<&String> = named.iter().filter(|text| text.starts_with('/')).collect();
    assert!(paths.len() > 15, "{paths:?}");
    for path in paths {
        // Robots' topics are alike, and only A's camera has taken an image here.
        let of_a = path.replacen("/B/", "/A/", 1).replacen("/C/", "/A/", 1);
        let (topic, field) = of_a.split_once('.').unwrap_or((&of_a, ""));
        let channel = summary.channels.values().find(|channel| channel.topic == topic);
        let channel = channel.unwrap_or_else(|| panic!("the layout names {path}, and there is no {topic}"));
        if !field.is_empty() {
            let schema: serde_json::Value =
                serde_json::from_slice(&channel.schema.as_ref().unwrap().data).unwrap();
            let field = field.split('[').next().unwrap();
            assert!(
                schema["properties"][field].is_object(),
                "the layout names {path}, and there is no {field}"
            );
        }
    }
}

/// Pending images take memory, so the episode waits before there are many.
#[test]
fn few_pictures_wait_for_the_recorder() {
    let folder = tempfile::tempdir().unwrap();
    let (recorder, _) = recorder(folder.path(), &world());
    let thread = RecorderThread::start(recorder).unwrap();
    let waiting = Arc::new(AtomicUsize::new(0));
    for _ in 0..100 {
        waiting.fetch_add(2, Ordering::SeqCst);
        let appended = waiting.clone();
        thread.append_pictures(2, move |_| {
            appended.fetch_sub(2, Ordering::SeqCst);
            Ok(())
        });
        let count = waiting.load(Ordering::SeqCst);
        assert!(count < 16, "{count} pictures wait");
    }
}
