//! Tests of recordings rendered again: videos, and images with depth.

mod exports;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::common::*;
use crate::skipped::skipped;
use image::AnimationDecoder;
use tandem_episodes::replay::{
    EpisodeCamera, EpisodeRenderer, FilmPlan, PictureSize, PicturesPlan, VideoError, draw_all, film,
};
use tandem_episodes::{Recorder, Recording, Session};
use tandem_tools_spec::Protocol;

const STEPS: u32 = 12;
const SIZE: PictureSize = PictureSize { width: 64, height: 48 };

/// Records a quarter of a second of Handover.
fn recorded(folder: &Path) -> Recording {
    let mut session = Session::start(&spec("handover", 3, Protocol::Benchmark), Some(folder)).unwrap();
    command(&mut session, raise_hand(STEPS));
    session.close();
    Recording::read(&folder.join(Recorder::FILE_NAME)).unwrap()
}

#[test]
fn films_have_a_picture_for_every_moment() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recorded(folder.path());
    let make = |name: &str, view: EpisodeCamera, rate_hz: u32| {
        let path = folder.path().join(name);
        let plan = FilmPlan { view, size: Some(SIZE), rate_hz, duration_s: None };
        film(&recording, &plan, &path).map(|pictures| (pictures, path))
    };
    let (pictures, gif) = make("a.gif", EpisodeCamera::ThirdPerson, 25).unwrap();
    assert_eq!(pictures, 7, "steps 0, 2, .. 12");
    let file = std::io::BufReader::new(std::fs::File::open(gif).unwrap());
    let frames = image::codecs::gif::GifDecoder::new(file).unwrap().into_frames().collect_frames().unwrap();
    assert_eq!((frames.len(), frames[0].buffer().dimensions()), (7, (SIZE.width, SIZE.height)));
    assert_eq!(frames[0].delay().numer_denom_ms(), (40, 1));

    let (pictures, webp) = make("a.webp", EpisodeCamera::Egocentric(1), 50).unwrap();
    assert_eq!(pictures, 13);
    assert_eq!(end_ms(&webp), 13 * 20);

    match make("a.mp4", EpisodeCamera::Egocentric(0), 10) {
        Ok((pictures, mp4)) => {
            let bytes = std::fs::read(mp4).unwrap();
            assert_eq!((pictures, &bytes[4..8]), (3, &b"ftyp"[..]));
        }
        Err(error @ VideoError::NoFfmpeg { .. }) => {
            assert!(error.to_string().contains(".webp or .gif"));
            skipped("no ffmpeg, so no film is made as MP4");
        }
        Err(error) => panic!("{error}"),
    }
    let text = make("a.avi", EpisodeCamera::ThirdPerson, 25).unwrap_err().to_string();
    assert!(text.contains("ends in .webp, .gif or .mp4"), "{text}");
    let text = EpisodeCamera::find("C", &recording.spec.task).unwrap_err();
    assert!(text.ends_with("have: third_person, A, B"), "{text}");
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(left.iter().all(|path| path.extension().is_none_or(|e| e != "partial")), "{left:?}");
}

/// Returns the time at which a WebP's last picture ends.
fn end_ms(webp: &Path) -> i32 {
    let bytes = std::fs::read(webp).unwrap();
    let decoder = webp_animation::Decoder::new(&bytes).unwrap();
    decoder.into_iter().map(|frame| frame.timestamp()).last().unwrap()
}

#[test]
fn films_play_within_the_seconds_that_are_given() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recorded(folder.path());
    for (rate_hz, pictures) in [(50, 13), (25, 7)] {
        let path = folder.path().join("slow.webp");
        let view = EpisodeCamera::ThirdPerson;
        let plan = FilmPlan { view, size: Some(SIZE), rate_hz, duration_s: Some(2) };
        assert_eq!(film(&recording, &plan, &path).unwrap(), pictures);
        let frame_ms = 2000 / pictures as i32;
        assert!((end_ms(&path) - 2000).abs() <= frame_ms, "{} ms", end_ms(&path));
    }
}

/// Returns every file below `folder` with its modification time.
fn files(folder: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        match entry.file_type().unwrap().is_dir() {
            true => found.extend(files(&entry.path())),
            false => drop(found.insert(entry.path(), entry.metadata().unwrap().modified().unwrap())),
        }
    }
    found
}

#[test]
fn pictures_are_drawn_once_whatever_stops_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recorded(&folder.path().join("episode"));
    let out = folder.path().join("pictures");
    let draw = |rate_hz: u32, jobs: usize| {
        draw_all(
            &recording,
            &PicturesPlan { rate_hz, size: Some(SIZE), jobs, ..PicturesPlan::default() },
            &out,
            &|| {},
        )
    };
    let drawn = draw(10, 2).unwrap();
    assert_eq!((drawn.moments, drawn.already_drawn, drawn.cameras), (3, 0, 3), "steps 0, 5 and 10");
    let before = files(&out);
    assert_eq!(before.len(), 3 * 3 * 2 + 2, "{before:?}");

    // A run that was killed while drawing has left a camera without its depth image.
    let lost = out.join("A/depth/000005.png");
    let depth_mm = image::open(&lost).unwrap().into_luma16();
    std::fs::remove_file(&lost).unwrap();
    let drawn = draw(10, 1).unwrap();
    assert_eq!((drawn.moments, drawn.already_drawn), (3, 2));
    let after = files(&out);
    let written = |path: &&PathBuf| before.get(*path) != after.get(*path) && !path.ends_with("poses.json");
    let written: Vec<_> = after.keys().filter(written).collect();
    assert_eq!(written, [&out.join("A/depth/000005.png"), &out.join("A/rgb/000005.png")]);
    assert_eq!(image::open(&lost).unwrap().into_luma16(), depth_mm);

    // The file holds the depth that the camera sees.
    let step = recording.steps().nth(5).unwrap().unwrap();
    let mut scene = EpisodeRenderer::of(&recording.spec).unwrap();
    let camera = scene.view(EpisodeCamera::Egocentric(0), &step, Some(SIZE));
    let seen = scene.draw(&step, &camera);
    for (mm, depth_m) in depth_mm.pixels().zip(&seen.depth_m) {
        let expected_m = if depth_m.is_finite() { *depth_m } else { 0.0 };
        assert!((f32::from(mm.0[0]) / 1000.0 - expected_m).abs() < 0.0006, "{mm:?} for {depth_m} m");
    }
    let text = draw(25, 1).unwrap_err().to_string();
    assert!(text.contains("pictures of another recording, rate or size"), "{text}");
}

/// A data set's images and a policy's observations are the same: the camera's own image, scaled.
/// Rendering at that size yields different pixels.
#[test]
fn small_pictures_are_the_cameras_own_scaled() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recorded(&folder.path().join("episode"));
    let step = recording.steps().nth(5).unwrap().unwrap();
    let mut scene = EpisodeRenderer::of(&recording.spec).unwrap();
    let view = EpisodeCamera::Egocentric(0);
    let small = PictureSize { width: 160, height: 120 };
    let own = scene.colours(view, &step, None);
    let colours = scene.colours(view, &step, Some(small));
    assert_eq!((own.width, own.height, colours.width, colours.height), (320, 240, 160, 120));
    assert_eq!(colours.rgb(), own.scaled([160, 120]).into_raw());
    let camera = scene.view(view, &step, Some(small));
    assert_ne!(scene.draw(&step, &camera).rgb, colours.rgb());

    // The one requested camera, without depth.
    let out = folder.path().join("lean");
    let plan = |name: &str| PicturesPlan {
        rate_hz: 10,
        size: Some(small),
        cameras: vec![name.into()],
        depth: false,
        ..PicturesPlan::default()
    };
    let drawn = draw_all(&recording, &plan("A"), &out, &|| {}).unwrap();
    assert_eq!((drawn.moments, drawn.cameras, files(&out).len()), (3, 1, 3 + 2));
    assert_eq!(image::open(out.join("A/rgb/000005.png")).unwrap().into_rgb8().into_raw(), colours.rgb());
    let text = draw_all(&recording, &plan("C"), &out, &|| {}).unwrap_err().to_string();
    assert!(text.contains("no camera \"C\"") && text.contains("third_person, A, B"), "{text}");
}
