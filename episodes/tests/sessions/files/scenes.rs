//! Tests of tasks in scenes from files: a kitchen in SceneSmith's export layout, and the errors of
//! unsuitable scenes.

use std::fs;
use std::path::{Path, PathBuf};

use tandem_episodes::replay::{Verdict, verify};
use tandem_episodes::{EpisodeSpec, Recording, SceneFile, Session, players};
use tandem_tools_spec::Protocol;

use crate::common::{play, spec, wait};

const KITCHEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scenes/kitchen");

fn in_scene(task: &str, scene: &Path) -> Result<EpisodeSpec, String> {
    let scene = SceneFile::of(scene).map_err(|error| error.to_string())?;
    Ok(EpisodeSpec { scene: Some(scene), ..spec(task, 3, Protocol::Benchmark) })
}

fn start(task: &str, scene: &Path) -> Result<Session, String> {
    Session::start(&in_scene(task, scene)?, None).map_err(|error| error.to_string())
}

/// Copies the kitchen, to be modified.
fn copy_of_kitchen(to: &Path) -> PathBuf {
    fs::create_dir(to.join("meshes")).unwrap();
    for folder in ["", "meshes"] {
        for entry in fs::read_dir(Path::new(KITCHEN).join(folder)).unwrap().map(Result::unwrap) {
            if entry.file_type().unwrap().is_file() {
                fs::copy(entry.path(), to.join(folder).join(entry.file_name())).unwrap();
            }
        }
    }
    to.join("handover.xml")
}

fn replace(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{} has no {from}", path.display());
    fs::write(path, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn the_expert_hands_over_in_a_scene_of_a_file() {
    let spec = in_scene("handover", &Path::new(KITCHEN).join("handover.xml")).unwrap();
    let mut episode = players::InProcess::new(Session::start(&spec, None).unwrap());
    players::find("expert").unwrap().play(&spec, &mut episode).unwrap();
    assert_eq!(episode.session.reached_phases(), 3);
}

#[test]
fn a_recording_is_replayed_in_the_scene_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let scene = copy_of_kitchen(folder.path());
    let spec = in_scene("handover", &scene).unwrap();
    let mut session = Session::start(&spec, Some(&folder.path().join("run"))).unwrap();
    play(&mut session);
    session.close();
    let recording = Recording::read(&folder.path().join("run/episode.mcap")).unwrap();
    assert_eq!(recording.spec, spec);
    assert_eq!(verify(&recording).unwrap().outcome, Verdict::Same);

    replace(&folder.path().join("meshes/island_convex_piece_000.obj"), "0.8", "0.81");
    let text = verify(&recording).unwrap_err().to_string();
    assert!(text.contains("has changed") && text.contains("handover.xml"), "{text}");
}

#[test]
fn sites_place_what_they_name() {
    let folder = tempfile::tempdir().unwrap();
    let scene = copy_of_kitchen(folder.path());
    let site = r#"<site name="bottle" pos="2.1 1.3 0.8" quat="0.7071068 0 0 0.7071068"/>"#;
    replace(&scene, "</worldbody>", &format!("{site}</worldbody>"));
    let mut session = start("handover", &scene).unwrap();
    wait(&mut session, 1);
    let moved_m = session.facts().position_m("bottle");
    // The offset of the site in the frame of the task's site, which is rotated by a quarter turn.
    let placed_m = tandem_sim::Vector::new(0.3, -0.1, 0.8);
    assert!((moved_m - placed_m).abs().max_element() <= 0.026, "{moved_m}");
}

/// Checks the error of the kitchen with `from` replaced by `to` in one of its files.
#[track_caller]
fn check(file: &str, from: &str, to: &str, expected: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let scene = copy_of_kitchen(folder.path());
    replace(&folder.path().join(file), from, to);
    let text = start("handover", &scene).err().expect("a scene that does not fit");
    for expected in expected {
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn what_a_scene_lacks_is_named() {
    check("handover.xml", r#"name="task""#, r#"name="here""#, &["no site \"task\"", "robot_A", "have: here"]);
    check("handover.xml", "0.7071068 0 0 0.7071068", "0.9 0.43 0 0", &["site \"task\"", "tilted by 51"]);
    check("handover.xml", r#"file="scene.xml""#, r#"file="hall.xml""#, &["hall.xml"]);
    check("scene.xml", "kitchen_north_wall_wall.obj", "wall.obj", &["cannot read", "meshes/wall.obj"]);
    check("scene.xml", "kitchen_north_wall_wall.obj", "wall.ply", &["wall.ply", "use .obj, .stl or .msh"]);
    check("scene.xml", "floor_texture.png", "floor.png", &["cannot read", "floor.png"]);
    check("scene.xml", r#"mesh="kitchen_island_visual_mesh""#, r#"mesh="top""#, &["mesh `top` is no asset"]);
    check(
        "scene.xml",
        r#"<geom name="wall_collision" type="box""#,
        r#"<geom name="wall_collision" type="sdf""#,
        &["wall_collision"],
    );
    check("scene.xml", r#"body2="kitchen_cupboard_1_door""#, r#"body2="door""#, &["exclude of `door`"]);
    check(
        "scene.xml",
        r#"<body name="kitchen_mug_2" "#,
        r#"<body name="bottle" "#,
        &["\"bottle\"", "rename it"],
    );
}

#[test]
fn a_place_where_nothing_stands_is_refused() {
    let island = r#"pos="2 1.37 0""#;
    check("scene.xml", island, r#"pos="-1 1.37 0""#, &["bottle does not stay", "something to stand on"]);
    check("scene.xml", r#"pos="0 0 -0.05""#, r#"pos="0 0 -0.5""#, &["robot A does not stay"]);
}

#[test]
fn a_scene_that_the_simulator_cannot_play_is_refused_after_its_trial() {
    let absurd = r#"damping="0.1" stiffness="1e12" springref="1e12""#;
    let says =
        ["handover.xml, in a trial of 1 s, in which nobody acts, physics diverged", "kitchen_cupboard_1"];
    check("scene.xml", r#"range="0 1.57" damping="0.1""#, absurd, &says);
}

#[test]
fn what_is_not_read_is_refused_where_it_stands() {
    let mug = r#"<body name="kitchen_mug_2" "#;
    let before_mug = |element: &str| format!("{element}{mug}");
    check("scene.xml", mug, &before_mug("<flexcomp name=\"cloth\"/>"), &["scene.xml:", "flexcomp `cloth`"]);
    check(
        "scene.xml",
        mug,
        &before_mug("<body><plugin plugin=\"mujoco.pid\"/></body>"),
        &["<plugin> is not read"],
    );
    let carcass = r#"<inertial pos="0 0 0.4" mass="30""#;
    let negative = &["scene.xml:", "body `kitchen_cupboard_1_carcass`", "mass=\"-30\""];
    check("scene.xml", carcass, &carcass.replace("30", "-30"), negative);
    check(
        "handover.xml",
        "</worldbody>",
        "<site name=\"task\"/></worldbody>",
        &["handover.xml:", "site `task`"],
    );
    check("handover.xml", "0.7071068 0 0 0.7071068", "0 0 0 0", &["handover.xml:", "quat=\"0 0 0 0\""]);
}

#[test]
fn what_is_approximated_in_a_scene_is_named() {
    let (_, approximations) =
        SceneFile::with_approximations(&Path::new(KITCHEN).join("handover.xml")).unwrap();
    let text = approximations.join("\n");
    for attribute in ["balanceinertia", "boundmass", "boundinertia"] {
        assert!(text.contains(&format!("has {attribute}: masses and inertias stay")), "{text}");
    }
}
