//! Tests of the moving geometry of recordings, as other renderers read it.

use std::path::Path;

use crate::common::*;
use serde_json::Value;
use tandem_episodes::replay::export;
use tandem_episodes::{Recorder, Recording, Session};
use tandem_sim::{Pose, Rotation, Step, Vector};
use tandem_tools_spec::Protocol;

/// Steps 0, 2, .. 12 of a quarter of a second.
const STEPS: u32 = 12;
const RATE_HZ: u32 = 25;
const MOMENTS: usize = 7;

/// Records a quarter of a second of Handover, and returns the steps of the moments, too.
fn recorded(folder: &Path) -> (Recording, Vec<Step>) {
    let mut session = Session::start(&spec("handover", 3, Protocol::Benchmark), Some(folder)).unwrap();
    command(&mut session, raise_hand(STEPS));
    session.close();
    let recording = Recording::read(&folder.join(Recorder::FILE_NAME)).unwrap();
    let steps = recording.steps().map(|step| step.unwrap()).step_by(2).collect();
    (recording, steps)
}

/// A binary glTF file, taken apart.
struct Glb {
    head: Value,
    numbers: Vec<u8>,
}

impl Glb {
    fn read(path: &Path) -> Glb {
        let file = std::fs::read(path).unwrap();
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(
            (&file[..4], word(4), word(8), &file[16..20]),
            (&b"glTF"[..], 2, file.len(), &b"JSON"[..])
        );
        let end = 20 + word(12);
        assert_eq!((word(end), &file[end + 4..end + 8]), (file.len() - end - 8, &b"BIN\0"[..]));
        Glb { head: serde_json::from_slice(&file[20..end]).unwrap(), numbers: file[end + 8..].to_vec() }
    }

    fn list(&self, name: &str) -> &[Value] {
        self.head[name].as_array().unwrap_or_else(|| panic!("no {name}"))
    }

    /// Returns the rows of an accessor of floating-point numbers.
    fn rows(&self, accessor: &Value) -> Vec<Vec<f32>> {
        let accessor = &self.list("accessors")[accessor.as_u64().unwrap() as usize];
        let columns = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            kind => kind[3..].parse().unwrap(),
        };
        let view = &self.list("bufferViews")[accessor["bufferView"].as_u64().unwrap() as usize];
        let [first, bytes] = ["byteOffset", "byteLength"].map(|name| view[name].as_u64().unwrap() as usize);
        let numbers = self.numbers[first..first + bytes].as_chunks::<4>().0;
        let numbers: Vec<f32> = numbers.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        let rows: Vec<Vec<f32>> = numbers.chunks(columns).map(<[f32]>::to_vec).collect();
        assert_eq!(rows.len() as u64, accessor["count"].as_u64().unwrap());
        rows
    }

    /// Returns the poses of a node at all moments; a single one if it does not move.
    fn poses(&self, name: &str) -> Vec<Pose> {
        let node = self.list("nodes").iter().position(|node| node["name"] == name);
        let node = node.unwrap_or_else(|| panic!("no node {name}"));
        let animation = &self.list("animations")[0];
        let track = |path: &str| {
            let channels = animation["channels"].as_array().unwrap();
            let found = channels.iter().find(|channel| {
                channel["target"]["node"] == node as u64 && channel["target"]["path"] == path
            });
            let sampler = &animation["samplers"][found?["sampler"].as_u64().unwrap() as usize];
            let times: Vec<f32> = self.rows(&sampler["input"]).concat();
            assert!(
                times.iter().enumerate().all(|(moment, time_s)| *time_s == moment as f32 / RATE_HZ as f32)
            );
            Some(self.rows(&sampler["output"]))
        };
        let still = |path: &str, usual: &[f32]| -> Vec<f32> {
            let stated = &self.list("nodes")[node][path];
            if stated.is_null() { usual.to_vec() } else { serde_json::from_value(stated.clone()).unwrap() }
        };
        let places = track("translation").unwrap_or_else(|| vec![still("translation", &[0.0; 3])]);
        let turns = track("rotation").unwrap_or_else(|| vec![still("rotation", &[0.0, 0.0, 0.0, 1.0])]);
        places.iter().zip(&turns).map(|(place, turn)| pose(place, turn)).collect()
    }
}

fn pose(place: &[f32], turn: &[f32]) -> Pose {
    Pose::from_parts(Vector::from_slice(place), Rotation::from_slice(turn))
}

fn are_near(a: &Pose, b: &Pose) -> bool {
    a.translation.abs_diff_eq(b.translation, 1e-5) && a.rotation.dot(b.rotation).abs() > 1.0 - 1e-5
}

#[test]
fn a_recording_moves_in_gltf_as_it_did() {
    let folder = tempfile::tempdir().unwrap();
    let (recording, steps) = recorded(folder.path());
    let path = folder.path().join("episode.glb");
    assert_eq!(export(&recording, RATE_HZ, &path).unwrap(), MOMENTS);
    let glb = Glb::read(&path);

    let hand = glb.poses("A/right_wrist_yaw_link");
    assert_eq!(hand.len(), MOMENTS);
    assert!(hand[0].translation.distance(hand[MOMENTS - 1].translation) > 0.01, "it was raised");
    let links = &steps[0].robots[0].truth.world_from_link;
    let link = links.iter().position(|link| are_near(link, &hand[0])).expect("a link of A");
    for (found, step) in hand.iter().zip(&steps) {
        assert!(are_near(found, &step.robots[0].truth.world_from_link[link]), "{found:?}");
    }
    let bottle = glb.poses("bottle");
    assert!(are_near(&bottle[0], &steps[0].objects[0].state.world_from_object), "{bottle:?}");
    assert_eq!((glb.poses("room").len(), glb.poses("third_person").len()), (1, 1), "these are still");
    assert_eq!(glb.list("cameras").len(), 3);
    let up = glb.poses("world")[0].rotation * Vector::Z;
    assert!(up.abs_diff_eq(Vector::Y, 1e-6), "{up}");
}

#[test]
fn surfaces_in_gltf_have_their_images() {
    let folder = tempfile::tempdir().unwrap();
    let (recording, _) = recorded(folder.path());
    let path = folder.path().join("episode.glb");
    export(&recording, 1, &path).unwrap();
    let glb = Glb::read(&path);
    let mut textured = 0;
    for primitive in glb.list("meshes").iter().flat_map(|mesh| mesh["primitives"].as_array().unwrap()) {
        let attributes = &primitive["attributes"];
        let points = glb.rows(&attributes["POSITION"]).len();
        assert_eq!(glb.rows(&attributes["NORMAL"]).len(), points);
        let material = &glb.list("materials")[primitive["material"].as_u64().unwrap() as usize];
        let image = &material["pbrMetallicRoughness"]["baseColorTexture"]["index"];
        if let Some(image) = image.as_u64() {
            assert_eq!(glb.rows(&attributes["TEXCOORD_0"]).len(), points);
            let view = &glb.list("images")[image as usize]["bufferView"];
            let view = &glb.list("bufferViews")[view.as_u64().unwrap() as usize];
            let [first, bytes] =
                ["byteOffset", "byteLength"].map(|name| view[name].as_u64().unwrap() as usize);
            image::load_from_memory(&glb.numbers[first..first + bytes]).expect("an image");
            textured += 1;
        }
    }
    assert!(textured > 0, "the kitchen's floor has tiles");
}

#[test]
fn a_recording_moves_in_usd_as_it_did() {
    let folder = tempfile::tempdir().unwrap();
    let (recording, steps) = recorded(folder.path());
    let path = folder.path().join("episode.usda");
    assert_eq!(export(&recording, RATE_HZ, &path).unwrap(), MOMENTS);
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.starts_with("#usda 1.0\n") && text.contains("upAxis = \"Z\""));
    let frame = |name: &str| text.split(&format!("def Xform \"{name}\"")).nth(1).expect("a frame");
    let numbers = |text: &str| -> Vec<f32> {
        let inside = text.split_once('(').and_then(|(_, rest)| rest.split_once(')')).expect("a tuple").0;
        inside.split(", ").map(|number| number.parse().unwrap()).collect()
    };
    let hand = frame("A_right_wrist_yaw_link");
    let samples = |operation: &str| -> Vec<Vec<f32>> {
        let begin = format!("xformOp:{operation}.timeSamples = {{\n");
        let (_, rest) = hand.split_once(&begin).expect("samples");
        rest.lines().take(MOMENTS).map(numbers).collect()
    };
    for ((place, turn), step) in samples("translate").iter().zip(&samples("orient")).zip(&steps) {
        let found = pose(place, &[turn[1], turn[2], turn[3], turn[0]]);
        assert!(step.robots[0].truth.world_from_link.iter().any(|link| are_near(link, &found)), "{found:?}");
    }
    let (_, bottle) = frame("bottle").split_once("xformOp:translate").expect("a place");
    let expected_m = steps[0].objects[0].state.world_from_object.translation;
    assert!(Vector::from_slice(&numbers(bottle)).abs_diff_eq(expected_m, 1e-5));
    let files: Vec<&str> = text.split('@').skip(1).step_by(2).collect();
    assert!(!files.is_empty());
    for file in files {
        image::open(folder.path().join(file)).expect("an image beside it");
    }
}

#[test]
fn other_formats_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let (recording, _) = recorded(folder.path());
    let error = export(&recording, RATE_HZ, &folder.path().join("episode.fbx")).unwrap_err().to_string();
    assert!(error.contains("ends in .glb or .usda"), "{error}");
}
