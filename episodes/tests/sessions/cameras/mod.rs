//! Tests of episodes with a D435i: all images and depths are the camera's.

use std::collections::BTreeMap;

use crate::common::*;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use tandem_episodes::replay::{EpisodeCamera, EpisodeRenderer, Verdict, verify};
use tandem_episodes::{CameraModel, EpisodeSpec, Recorder, Recording, RendererKind, Session};
use tandem_tools_spec::{
    DepthReply, DepthRow, LookReply, Observation, Observe, PixelRegion, Pose, Protocol, QueryDepth,
    SurfaceQuery, Tool as _, ToolCall, ToolReply, Walk, WalkMove,
};

fn d435i(seed: u32) -> EpisodeSpec {
    let spec = spec("handover", seed, Protocol::Benchmark);
    EpisodeSpec { camera: CameraModel::D435i, renderer: RendererKind::Cpu, ..spec }
}

fn look(session: &mut Session) -> Observation {
    match session.call(Observe::of_all().into()).unwrap() {
        ToolReply::Look(LookReply::Observe(seen)) => seen,
        other => panic!("{other:?} is no observation"),
    }
}

fn measure(session: &mut Session, asked: QueryDepth) -> DepthReply {
    match session.call(asked.into()).unwrap() {
        ToolReply::Look(LookReply::QueryDepth(reply)) => reply,
        other => panic!("{other:?} is no depth"),
    }
}

/// Returns a command with which A turns on the spot.
fn turn(steps: u32) -> ToolCall {
    let entry = WalkMove {
        robot: "A".into(),
        vx_m_s: 0.0,
        vy_m_s: 0.0,
        yaw_rate_rad_s: 0.5,
        pelvis_height_m: None,
        waist_yaw_rad: None,
        look_at_m: None,
    };
    Walk { steps, robots: vec![entry] }.into()
}

/// A moving camera's images depend on the step before, which the recording contains.
#[test]
fn what_a_recording_draws_again_is_what_was_seen() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = Session::start(&d435i(5), Some(folder.path())).unwrap();
    let mut seen = BTreeMap::new();
    for _ in 0..4 {
        let images = look(&mut session).images;
        let control_step = session.present().control_step;
        seen.insert(control_step, images.into_iter().map(|image| image.png_base64.0).collect::<Vec<_>>());
        command(&mut session, turn(20));
    }
    let result = session.close();
    assert_eq!(result.departures[2..], ["assistance: full", "camera: d435i"]);
    let ideal = EpisodeSpec { camera: CameraModel::Ideal, ..d435i(5) };
    let mut other = Session::start(&ideal, None).unwrap();
    (0..4).for_each(|_| drop(command(&mut other, turn(20))));
    assert_eq!(other.close().state_hash, result.state_hash, "cameras move nothing");

    let recording = Recording::read(&folder.path().join(Recorder::FILE_NAME)).unwrap();
    assert_eq!(recording.spec.camera, CameraModel::D435i);
    assert_eq!(verify(&recording).unwrap().outcome, Verdict::Same);
    let mut scene = EpisodeRenderer::of(&recording.spec).unwrap();
    let mut moving = 0;
    for mut step in recording.steps().map(Result::unwrap) {
        let Some(images) = seen.remove(&step.control_step) else { continue };
        for (robot, png) in images.into_iter().enumerate() {
            let view = EpisodeCamera::Egocentric(robot);
            let again = scene.colours(view, &step, None);
            assert!(*again.png().unwrap() == *png, "robot {robot} after step {}", step.control_step);
            let before = step.robots[robot].truth.world_from_camera_before.take();
            moving += usize::from(before.is_some() && scene.colours(view, &step, None).rgb() != again.rgb());
        }
    }
    assert!(seen.is_empty() && moving > 2, "{moving} images show that the camera moves");
}

#[test]
fn an_ideal_camera_is_not_even_named() {
    let ideal = EpisodeSpec { camera: CameraModel::Ideal, ..d435i(5) };
    assert_eq!(serde_json::to_value(&ideal).unwrap().get("camera"), None);
    assert_eq!(serde_json::to_value(d435i(5)).unwrap()["camera"], "d435i");
    let mut session = Session::start(&ideal, None).unwrap();
    assert!(look(&mut session).cameras.iter().all(|camera| camera.distortion.is_none()));
    assert!(!session.briefing().brief.camera.contains("D435i"));
}

fn isometry(pose: &Pose) -> Isometry3<f64> {
    let [w, i, j, k] = pose.quaternion_wxyz;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
    Isometry3::from_parts(Translation3::from(pose.position_m), rotation)
}

/// Points measured by depth agree with the objects' positions although the image is distorted. The
/// calibration states the distortion.
#[test]
fn points_of_a_distorted_image_are_right_and_holes_have_none() {
    let [mut real, mut ideal] = [CameraModel::D435i, CameraModel::Ideal]
        .map(|camera| Session::start(&EpisodeSpec { camera, ..d435i(5) }, None).unwrap());
    let camera = look(&mut real).cameras.remove(0);
    let lens = camera.distortion.clone().expect("a D435i's lens");
    let everywhere = || {
        let region = Some(PixelRegion { from: [2, 2], to: [317, 237], stride: 5 });
        QueryDepth { region, pixels: None, ..QueryDepth::example() }
    };
    let measured = measure(&mut real, everywhere()).points;
    // This is the projection of OpenCV's projectPoints, for points in the camera's frame.
    let seen_at = |[x, y]: [f64; 2]| {
        let [k1, k2, p1, p2, _] = lens.coefficients;
        let rr = x * x + y * y;
        let outwards = 1.0 + k1 * rr + k2 * rr * rr;
        [
            camera.fx * (x * outwards + 2.0 * p1 * x * y + p2 * (rr + 2.0 * x * x)) + camera.cx,
            camera.fy * (y * outwards + p1 * (rr + 2.0 * y * y) + 2.0 * p2 * x * y) + camera.cy,
        ]
    };
    let pelvis_from_camera = isometry(&camera.camera_in_pelvis);
    let mut straight_off_px = 0.0f64;
    let (mut depths_m, mut pixels) = (Vec::new(), Vec::new());
    for row in &measured {
        let Some(point_m) = row.point_m() else { continue };
        let in_camera = pelvis_from_camera.inverse() * Point3::from(point_m);
        let ray = [in_camera.x / in_camera.z, in_camera.y / in_camera.z];
        let [u, v] = seen_at(ray);
        assert!((u - row.0 as f64).hypot(v - row.1 as f64) < 0.5, "{row:?} is seen at {u}, {v}");
        let straight = [camera.fx * ray[0] + camera.cx, camera.fy * ray[1] + camera.cy];
        straight_off_px = straight_off_px.max((u - straight[0]).hypot(v - straight[1]));
        depths_m.push(in_camera.z);
        pixels.push(straight.map(|px| px.round() as i64));
    }
    assert!(straight_off_px > 1.0, "the lens moves nothing: {straight_off_px}");
    let asked = QueryDepth { pixels: Some(pixels), ..QueryDepth::example() };
    let truly = measure(&mut ideal, asked).points;
    let is_right = |(depth_m, truly): &(f64, DepthRow)| {
        let Some(point_m) = truly.point_m() else { return false };
        let true_m = (pelvis_from_camera.inverse() * Point3::from(point_m)).z;
        // The tolerance is five standard deviations, and a pixel of a slanted surface.
        (depth_m - true_m).abs() < 5.0 * 0.0025 * true_m * true_m + 0.02 * true_m
    };
    let of = depths_m.len();
    let right = depths_m.into_iter().zip(truly).filter(is_right).count();
    assert!(of > 2000 && right as f64 > 0.97 * of as f64, "{right} of {of}");
    let holes: Vec<_> = measured.iter().filter(|row| row.point_m().is_none()).collect();
    assert!(!holes.is_empty() && holes.len() < measured.len() / 5, "{} holes", holes.len());

    let pixel = Some([holes[0].0, holes[0].1]);
    let surface = Some(SurfaceQuery { pixel, color: None, object: None });
    let asked = QueryDepth { surface, pixels: None, ..QueryDepth::example() };
    let text = real.call(asked.into()).unwrap_err().to_string();
    assert!(text.contains("no depth at pixel") && text.contains("beside it"), "{text}");
    assert!(real.briefing().brief.camera.contains("D435i"));
}
