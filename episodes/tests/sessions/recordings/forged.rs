//! Tests of forged recordings: reading, scoring, verification and takeover report an error, without a
//! hang, a panic or memory exhaustion.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::Path;

use mcap::records::Record;
use serde_json::{Value, json};
use tandem_episodes::replay::verify;
use tandem_episodes::{EpisodeSpec, MomentStart, Recorder, Recording, Session, Start};
use tandem_tools_spec::Protocol;

use crate::common::*;

type Entries = BTreeMap<String, String>;

/// Records a few steps of a task into `folder`.
fn record(task: &str, folder: &Path) {
    let mut session = Session::start(&spec(task, 3, Protocol::Benchmark), Some(folder)).unwrap();
    wait(&mut session, 3);
    session.close();
}

/// Returns the metadata records of a recording.
fn entries(bytes: &[u8]) -> Vec<mcap::records::Metadata> {
    let records = mcap::read::LinearReader::new(bytes).unwrap().map(Result::unwrap);
    let metadata = records.filter_map(|record| match record {
        Record::Metadata(found) => Some(found),
        _ => None,
    });
    metadata.collect()
}

/// Replaces a recording with a copy as another program might write it, with changed metadata of its episode.
fn forge(folder: &Path, change: impl Fn(&mut Entries)) {
    let path = folder.join(Recorder::FILE_NAME);
    let bytes = fs::read(&path).unwrap();
    let mut copy = Vec::new();
    let mut writer =
        mcap::WriteOptions::new().library("another program").create(Cursor::new(&mut copy)).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        writer.write(&message.unwrap()).unwrap();
    }
    for mut metadata in entries(&bytes) {
        metadata.metadata.remove("crc32");
        if metadata.name == "episode" {
            change(&mut metadata.metadata);
        }
        writer.write_metadata(&metadata).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    fs::write(path, copy).unwrap();
}

fn begin_at(entries: &mut Entries, recording: &Path) {
    let mut spec: Value = serde_json::from_str(&entries["spec"]).unwrap();
    spec["start"] = json!({ "moment": { "recording": recording, "control_step": 1, "before_s": null } });
    entries.insert("spec".into(), spec.to_string());
}

#[cfg(unix)]
#[test]
fn nothing_is_read_of_what_a_recording_names() {
    let folder = tempfile::tempdir().unwrap();
    record("handover", folder.path());
    let own = folder.path().join(Recorder::FILE_NAME);
    let take_over = |recording: &Path| {
        let moment = MomentStart { recording: recording.into(), control_step: 1, before_s: None };
        let spec = EpisodeSpec { start: Start::Moment(moment), ..spec("handover", 3, Protocol::Benchmark) };
        Session::start(&spec, None).map(drop).map_err(|error| error.to_string())
    };
    take_over(&own).unwrap();
    let endless = take_over(Path::new("/dev/zero")).unwrap_err();
    assert!(endless.contains("no regular file"), "{endless}");

    // One recording starts from a device, the other from itself.
    for names in [Path::new("/dev/zero"), &own] {
        forge(folder.path(), |entries| begin_at(entries, names));
        let text = verify(&Recording::read(&own).unwrap()).map(drop).unwrap_err().to_string();
        assert!(text.contains("begins elsewhere") && text.contains("no checkpoint"), "{text}");
        assert_eq!(take_over(&own).unwrap_err(), text);
    }
}

#[cfg(unix)]
#[test]
fn a_scene_that_a_recording_names_has_an_end() {
    let folder = tempfile::tempdir().unwrap();
    record("handover", folder.path());
    forge(folder.path(), |entries| {
        let mut spec: Value = serde_json::from_str(&entries["spec"]).unwrap();
        spec["scene"] = json!({ "path": "/dev/zero", "xxh3": "00" });
        entries.insert("spec".into(), spec.to_string());
    });
    let text = verify(&Recording::read(folder.path()).unwrap()).map(drop).unwrap_err().to_string();
    assert!(text.contains("/dev/zero") && text.contains("no regular file"), "{text}");
}

#[test]
fn what_is_of_another_task_is_not_scored() {
    let [handover, pouring] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    record("handover", handover.path());
    record("co_pouring", pouring.path());
    let of = |folder: &Path| {
        let bytes = fs::read(folder.join(Recorder::FILE_NAME)).unwrap();
        entries(&bytes).into_iter().find(|found| found.name == "episode").unwrap().metadata
    };
    let other = of(pouring.path());
    let score = || Recording::read(handover.path()).unwrap().score().map(drop).unwrap_err().to_string();
    forge(handover.path(), |entries| drop(entries.insert("scores".into(), other["scores"].clone())));
    assert!(score().contains("the scores at its beginning are not those of an episode of handover"));

    record("handover", handover.path());
    let three = tempfile::tempdir().unwrap();
    record("move_house", three.path());
    let spec = of(three.path())["spec"].clone();
    forge(handover.path(), |entries| drop(entries.insert("spec".into(), spec.clone())));
    assert!(
        score().contains("the robots of a step are not those of an episode of move_house"),
        "{}",
        score()
    );
}
