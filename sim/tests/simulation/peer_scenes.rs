//! The scenes for comparing Tandem's physics with MuJoCo. The reader finds the same bodies, masses and
//! coordinates as MuJoCo. The sensors' readings stay within the tolerance recorded with MuJoCo's readings.

use std::path::{Path, PathBuf};

use mjcf_rs::extras::Sensor;
use serde_json::Value;
use tandem_sim::mjcf::{BodyLink, BodyTree, Document, LinkJoint};
use tandem_sim::{CONTROL_HZ, Step, Vector, World};

/// Returns each scene's file and the data recorded with MuJoCo.
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
    assert_eq!(scenes.len(), 14, "scenes in {}", folder.display());
    scenes
}

fn read(path: &Path) -> (Document, Vec<BodyTree>) {
    let document = Document::read(path).unwrap_or_else(|error| panic!("{error}"));
    let trees = document.trees().unwrap_or_else(|error| panic!("{error}"));
    (document, trees)
}

fn moving(trees: &[BodyTree]) -> impl Iterator<Item = &BodyLink> {
    let links = trees.iter().filter(|tree| !tree.is_fixed()).flat_map(|tree| &tree.links);
    links.filter(|link| link.joint != LinkJoint::Fixed)
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
        let keys = document.keys().unwrap_or_else(|error| panic!("{error}"));
        assert!(keys.iter().any(|key| key.name == "start"), "{at} has no key `start`");

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

/// Returns a sensor's reading, in MuJoCo's order.
fn reading(world: &World, step: &Step, sensor: &Sensor) -> Vec<f64> {
    let name = sensor.objname.as_deref().unwrap_or_default();
    if sensor.kind == "jointpos" {
        return vec![world.joint_position(name).unwrap_or_else(|| panic!("no joint `{name}`"))];
    }
    let site = |of: &str| world.object_models().find_map(|(object, model)| Some((object, model.site(of)?)));
    let (object, position_m) = match sensor.objtype.as_deref() {
        Some("site") => {
            let (object, site) = site(name).unwrap_or_else(|| panic!("no site `{name}`"));
            (object, site.position_m())
        }
        _ => (name, Vector::ZERO),
    };
    let state = step.object(object).unwrap_or_else(|| panic!("no object `{object}`"));
    let vector = match sensor.kind.as_str() {
        "framepos" => state.world_from_object * position_m,
        "framexaxis" => state.world_from_object.rotation * Vector::X,
        "framezaxis" => state.world_from_object.rotation * Vector::Z,
        "frameangvel" => state.angular_velocity_rad_s,
        other => panic!("sensor `{name}` is a {other}; read it here"),
    };
    vector.to_array().map(f64::from).to_vec()
}

/// Returns the readings of all sensors at the instants of the reference: instants x sensors.
fn play(document: Document, reference: &Value) -> Vec<Vec<Vec<f64>>> {
    let [seconds, hz] = ["seconds", "hz"].map(|key| reference[key].as_f64().expect("a number"));
    let sensors = document.model.sensors.clone();
    let mut world = World::of_scene(document).unwrap_or_else(|error| panic!("{error}"));
    let mut step = world.present();
    let mut readings = Vec::new();
    for sample in 0..=(seconds * hz).round() as u64 {
        while step.control_step < sample * (CONTROL_HZ / hz).round() as u64 {
            step = world.control_step(&[]).unwrap_or_else(|error| panic!("{error}"));
        }
        readings.push(sensors.iter().map(|sensor| reading(&world, &step, sensor)).collect());
    }
    readings
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("numbers").iter().map(|number| number.as_f64().expect("a number")).collect()
}

/// Returns the worst deviation of a quantity of a scene beyond its tolerance; `None` if there is none.
/// With a `since_s` in the reference, the change of the error since then counts.
fn violation(reference: &Value, quantity: &Value, have: &[Vec<f64>]) -> Option<String> {
    let [hz, since_s] = ["hz", "since_s"].map(|key| reference[key].as_f64().expect("a number"));
    let tolerance = quantity["tolerance"].as_f64().expect("a tolerance");
    let truth: Vec<Vec<f64>> = quantity["truth"].as_array().expect("instants").iter().map(numbers).collect();
    assert_eq!(truth.len(), have.len(), "instants of {}", quantity["name"]);
    let since = (since_s * hz).round() as usize;
    let error = |instant: usize, component: usize| have[instant][component] - truth[instant][component];
    let off = |instant: usize| {
        let at_first = |component| if since > 0 { error(since, component) } else { 0.0 };
        let apart = (0..truth[instant].len()).map(|c| (error(instant, c) - at_first(c)).abs());
        apart.fold(0.0, f64::max)
    };
    let beyond: Vec<usize> = (since..truth.len()).filter(|instant| off(*instant) > tolerance).collect();
    let worst = beyond.iter().copied().max_by(|a, b| off(*a).total_cmp(&off(*b)))?;
    let at_s = |instant: usize| instant as f64 / hz;
    Some(format!(
        "{}: {} is off by up to {:.4}, beyond its {tolerance} at {} of {} instants from {:.2} s on; at {:.2} s it is {:.4?}, not {:.4?}",
        reference["scene"],
        quantity["name"],
        off(worst),
        beyond.len(),
        truth.len(),
        at_s(beyond[0]),
        at_s(worst),
        have[worst],
        truth[worst],
    ))
}

#[test]
fn bodies_move_as_in_mujoco() {
    let mut violations = Vec::new();
    for (path, reference) in references() {
        let (document, _) = read(&path);
        let readings = play(document, &reference);
        for (index, quantity) in reference["quantities"].as_array().expect("quantities").iter().enumerate() {
            let have: Vec<Vec<f64>> = readings.iter().map(|instant| instant[index].clone()).collect();
            violations.extend(violation(&reference, quantity, &have));
        }
    }
    assert!(violations.is_empty(), "{} violations\n{}", violations.len(), violations.join("\n"));
}
