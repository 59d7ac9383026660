//! The scenes that MuJoCo judges our physics by, as our reader sees them: the same bodies, masses and coordinates.

use std::path::{Path, PathBuf};

use serde_json::Value;
use tandem_sim::mjcf::{BodyLink, BodyTree, Document};

/// MuJoCo's recorded view of a scene, and the scene's file beside it.
fn references() -> Vec<(PathBuf, Value)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/peers/scenes");
    let entries = std::fs::read_dir(&folder).expect("the folder of the scenes");
    let paths = entries.map(|entry| entry.expect("an entry of a folder").path());
    let scenes: Vec<(PathBuf, Value)> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .map(|path| {
            let text = std::fs::read_to_string(&path).expect("a reference");
            (path.with_extension("xml"), serde_json::from_str(&text).expect("JSON"))
        })
        .collect();
    assert_eq!(scenes.len(), 12, "scenes in {}", folder.display());
    scenes
}

fn read(path: &Path) -> (Document, Vec<BodyTree>) {
    let document = Document::read(path).unwrap_or_else(|error| panic!("{error}"));
    let trees = document.trees().unwrap_or_else(|error| panic!("{error}"));
    (document, trees)
}

fn moving(trees: &[BodyTree]) -> impl Iterator<Item = &BodyLink> {
    trees.iter().filter(|tree| !tree.is_fixed()).flat_map(|tree| &tree.links)
}

fn close(have: f64, expected: f64) -> bool {
    (have - expected).abs() <= 1e-4 * expected.abs()
}

#[test]
fn moving_bodies_weigh_what_they_weigh_in_mujoco() {
    for (path, reference) in references() {
        let (_, trees) = read(&path);
        let bodies = reference["bodies"].as_array().expect("bodies");
        let links: Vec<&BodyLink> = moving(&trees).collect();
        let names: Vec<&str> = links.iter().map(|link| link.name.as_str()).collect();
        let expected: Vec<&str> = bodies.iter().filter_map(|body| body["name"].as_str()).collect();
        assert_eq!(names, expected, "{}", path.display());
        for (link, body) in links.into_iter().zip(bodies) {
            let mass_kg = body["mass_kg"].as_f64().expect("a mass");
            let mut inertia = link.mass.principal_inertia().to_array().map(f64::from);
            inertia.sort_by(f64::total_cmp);
            let at = format!("`{}` of {}", link.name, path.display());
            assert!(close(f64::from(link.mass.mass()), mass_kg), "{at}: {} kg", link.mass.mass());
            for (have, expected) in inertia.into_iter().zip(body["inertia_kg_m2"].as_array().expect("three"))
            {
                assert!(close(have, expected.as_f64().expect("a number")), "{at}: {have} not {expected}");
            }
        }
    }
}

#[test]
fn every_scene_says_where_it_begins_and_what_is_read() {
    for (path, reference) in references() {
        let (document, trees) = read(&path);
        let at = path.display();
        let coordinates: usize = moving(&trees).map(|link| link.joint.coordinates()).sum();
        let actuators = document.actuators().unwrap_or_else(|error| panic!("{error}")).len();
        document.equalities().unwrap_or_else(|error| panic!("{error}"));
        let start = document.model.keyframes.iter().find(|key| key.name.as_deref() == Some("start"));
        let start = start.unwrap_or_else(|| panic!("{at} has no key `start`"));
        // A file may leave out what is as its bodies stand.
        assert!([0, coordinates].contains(&start.qpos.len()), "{at}: {} in qpos", start.qpos.len());
        assert!([0, actuators].contains(&start.ctrl.len()), "{at}: {} in ctrl", start.ctrl.len());

        let sensors: Vec<Option<&str>> =
            document.model.sensors.iter().map(|sensor| sensor.name.as_deref()).collect();
        let quantities = reference["quantities"].as_array().expect("quantities");
        let recorded: Vec<Option<&str>> = quantities.iter().map(|one| one["name"].as_str()).collect();
        assert_eq!(sensors, recorded, "{at}");
        for sensor in &document.model.sensors {
            let object = sensor.objname.as_deref().unwrap_or_default();
            let found = trees.iter().flat_map(|tree| &tree.links).any(|link| {
                link.name == object
                    || link.joint.name() == Some(object)
                    || link.sites.iter().any(|site| site.name == object)
            });
            assert!(found, "{at}: nothing is called `{object}`");
        }
    }
}
