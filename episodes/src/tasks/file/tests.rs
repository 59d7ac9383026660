//! Tests of task files, valid and invalid.

use super::*;
use crate::EpisodeSpec;
use crate::scoring::{A, Done, Facts, Grip};
use crate::tasks::{TANDEM_PLUS, TaskSet, tandem_plus};
use tandem_sim::Side::Right;
use tandem_sim::mjcf::Document;
use tandem_tools_spec::Protocol;

const FILE: &str = r#"
id = "lift_it"
scene = "floor"
instruction = "Lift the box."

[[robots]]
name = "A"
position_m = [0, 0]
instruction = "Lift the box."

[[objects]]
name = "box"
position_m = [0.4, 0, 0.05]
mjcf = '''
<mujoco model="box">
  <worldbody><body name="box"><freejoint/><geom type="box" size="0.05 0.05 0.05" mass="0.3"/></body></worldbody>
</mujoco>'''

[[randomize]]
objects = ["box"]
x_m = 0.02
yaw_deg = [-5, 10]

[terms]
high_m = '0.03'
held = 'holds("A", "right", "box")'

[[phases]]
id = "lift"
description = "It is lifted."
done = 'held && lift_m("box") >= high_m'

[[phases]]
id = "carry"
description = "It is carried away and put down."
first = 'held && x_m("box") > 1'
then = 'released_for_s("box") >= 0.2'
broken = 'fallen("A")'

[[phases]]
id = "stay"
description = "It stays, and the robot goes home."
lasting = 'x_m("box") > 1'
for_s = 0.5
at_end = 'speed_m_s("box") < 0.1'
near = 'coming(x_m("box"), 0.4, 1)'
"#;

fn source(text: &str) -> TaskSource {
    TaskSource { name: "lift.toml".into(), text: text.into(), ..TaskSource::default() }
}

fn load(text: &str) -> Result<Task, String> {
    task_of(source(text)).map_err(|error| error.to_string())
}

#[test]
fn a_file_becomes_a_task_like_any_other() {
    let task = load(FILE).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((task.id.as_str(), task.scene.as_str()), ("lift_it", "floor"));
    assert_eq!((task.robots.len(), task.benchmark_steps), (1, 1000));
    assert_eq!((task.agentic_steps, task.thinking_s, task.xxh3.len()), (6000, 1800, 16));
    let rest = Facts::at_rest(&task);
    let held = rest.clone().grip(A, Right, "box", Grip::Holding);
    let Done::When(lifted) = &task.phases[0].done else { panic!("it is reached at once") };
    let mut aloft = held.clone();
    aloft.object_mut("box").pose_in_world.translation.z += 0.031;
    assert_eq!([&rest, &held, &aloft].map(|facts| lifted.holds(facts)), [false, false, true]);
    let near = [&rest, &held, &aloft].map(|facts| (task.phases[0].nearness)(facts));
    assert!(near[0] > 0.0 && near[0] < 0.5 && near[1] == 0.5 && near[2] == 1.0, "{near:?}");
    let Done::Lasting { for_s, .. } = &task.phases[2].done else { panic!("it has to last") };
    assert_eq!(*for_s, 0.5);
    // Equal files are read once, and different files are not the same.
    assert!(std::ptr::eq(&*task, &*load(FILE).unwrap()));
    assert_ne!(task, load(&FILE.replace("0.03", "0.04")).unwrap());
}

#[test]
fn a_file_is_kept_while_one_of_its_tasks_is_in_use() {
    let own = source(&with_choice().replace("lift_it", "lift_it_for_a_while"));
    let is_own = |file: &TaskFile| file.undecided.source == own;
    let task = task_of(own.clone()).unwrap();
    let drawn = task.under(3);
    drop(task);
    assert!(in_use(is_own).is_some());
    drop(drawn);
    assert!(in_use(is_own).is_none());
}

/// Returns the file with a choice that the shared instruction does not reveal.
fn with_choice() -> String {
    let text = FILE.replacen(
        "instruction = \"Lift the box.\"",
        "instruction = \"Lift the box by the {side}.\"\nshared_instruction = \"Lift the box.\"",
        1,
    );
    text.replace("\"right\", \"box\"", "\"{side}\", \"box\"")
        .replace("[[robots]]", "[[choices]]\nname = \"side\"\noptions = [\"left\", \"right\"]\n\n[[robots]]")
}

#[test]
fn a_seed_chooses_and_nobody_is_told_before() {
    let text = with_choice();
    let task = load(&text).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(task.instruction, "Lift the box by the [left / right].");
    assert_eq!((task.chosen("side"), task.shared_instruction.as_deref()), (None, Some("Lift the box.")));
    let mut counts = [0; 2];
    for seed in 0..1000 {
        let drawn = task.under(seed);
        let side = drawn.chosen("side").unwrap();
        counts[usize::from(side == "right")] += 1;
        assert!(std::ptr::eq(&*drawn.under(seed), &*drawn) && drawn == task);
        assert_eq!(drawn.instruction, format!("Lift the box by the {side}."));
        let held = Facts::at_rest(&drawn).grip(A, Right, "box", Grip::Holding).raised("box", 0.04);
        let Done::When(lifted) = &drawn.phases[0].done else { panic!("it is reached at once") };
        assert_eq!(lifted.holds(&held), side == "right");
    }
    assert!(counts.iter().all(|count| (430..=570).contains(count)), "{counts:?}");
    // A recording stores the chosen option, and a spec with another seed draws a new one.
    let spec = EpisodeSpec::new(&task, 3, Protocol::Benchmark);
    let read: EpisodeSpec = serde_json::from_str(&serde_json::to_string(&spec).unwrap()).unwrap();
    assert!(std::ptr::eq(&*read.task, &*spec.task), "{:?}", read.task.chosen("side"));
    assert!((0..20).any(|seed| spec.seeded(seed).task.chosen("side") != spec.task.chosen("side")));
}

#[test]
fn mistakes_in_choices_are_told_by_their_places() {
    let check = |right: &str, wrong: &str, expected: &str| {
        let text = with_choice();
        assert!(text.contains(right), "{right}");
        let error = load(&text.replace(right, wrong)).expect_err(wrong);
        assert!(error.contains(expected), "{wrong}: {error}");
    };
    check("[\"left\", \"right\"]", "[\"left\"]", "lift.toml:9:11: there is nothing to choose");
    check("[\"left\", \"right\"]", "[\"left\", \"left\"]", "this option is given twice");
    check("[\"left\", \"right\"]", "[\"left\", \"a 'b'\"]", "an option is a word or two without quotes");
    check("{side}", "{other}", "lift.toml:8:8: nothing in the file asks for it; write {side}");
    // A mistake in only one of the combinations is reported too, with its line in the written file.
    let one_way = "no hand \"rigt\"; is it right?; have: left, right (with side = rigt)\n 31 | held = 'holds(\"A\", \"{side}\", \"box\")'\n    |                    ^^^^^^^^";
    check("[\"left\", \"right\"]", "[\"left\", \"rigt\"]", one_way);
    // The position is also correct after a filled placeholder.
    check(
        "\"{side}\", \"box\"",
        "\"{side}\", \"bax\"",
        "lift.toml:31:30: no object \"bax\"; is it box?; have: box\n",
    );
    check(
        "Lift the box by the {side}.",
        "Lift {sid} {side}.",
        "no choice \"sid\"; is it side?; [[choices]] have: side",
    );
    let error = load(&FILE.replacen("Lift the box.", "Lift the {box}.", 1)).unwrap_err();
    assert!(error.contains("lift.toml:4:25: no choice \"box\"; [[choices]] have: none"), "{error}");
}

/// A rewording of the file with a choice, with the same information for the robot.
const OTHER_WORDS: &str = r#"
[[rewordings]]
instruction = "Raise the box by its {side} side."
shared_instruction = "Raise the box."
robots.A = "Raise it by its {side} side."
"#;

#[test]
fn a_file_may_have_other_words_of_its_own() {
    let text = with_choice() + &OTHER_WORDS.repeat(2) + &OTHER_WORDS.replace("Raise", "Up with");
    let task = load(&text).unwrap_or_else(|error| panic!("{error}"));
    let words = |task: &Task| task.rewordings.clone().unwrap();
    assert_eq!(words(&task)[0].joint, "Raise the box by its [left / right] side.");
    let drawn = task.under(3);
    let side = drawn.chosen("side").unwrap();
    assert_eq!(words(&drawn)[2].robots, [format!("Up with it by its {side} side.")]);
    assert_eq!(words(&drawn)[2].shared.as_deref(), Some("Up with the box."));
    let check = |text: String, expected: &str| {
        let error = load(&text).expect_err(expected);
        assert!(error.contains(expected), "{error}");
    };
    check(with_choice() + OTHER_WORDS, "there are 3 [[rewordings]] or none");
    check(text.replace("robots.A", "robots.B"), "give words for each robot: { A = \"...\" }");
    check(text.replace("shared_instruction = \"Raise the box.\"\n", ""), "so has each of [[rewordings]]");
    check(
        FILE.to_owned() + &OTHER_WORDS.replace("{side} ", "").repeat(3),
        "no shared_instruction to word anew",
    );
    check(text.replace("its {side} side.\"\nshared", "its {sid} side.\"\nshared"), "no choice \"sid\"");
}

#[test]
fn a_file_says_that_hands_have_to_close() {
    let without =
        FILE.replace("held = 'holds(\"A\", \"right\", \"box\")'", "held = '!hands_off(\"A\", \"box\")'");
    assert!(load(FILE).unwrap().needs_fingers());
    assert!(!load(&without).unwrap().needs_fingers());
    let told = without.replace("held = ", "# Nobody holds(anything).\nheld = ");
    assert!(!load(&told).unwrap().needs_fingers(), "a comment asks for nothing");
    let says = without.replace("scene = \"floor\"", "scene = \"floor\"\nneeds_fingers = true");
    assert!(load(&says).unwrap().needs_fingers());
    assert!(tandem_plus().iter().all(|task| task.needs_fingers()));
}

#[test]
fn conditions_ask_what_was_chosen() {
    let asks = r#""{side}" == "left" ? z_m("box") > 1 : z_m("box") > 2"#;
    let text = with_choice().replace("held && lift_m(\"box\") >= high_m", asks);
    let task = load(&text).unwrap_or_else(|error| panic!("{error}"));
    for seed in 0..20 {
        let drawn = task.under(seed);
        let Done::When(high) = &drawn.phases[0].done else { panic!("it is reached at once") };
        let raised = Facts::at_rest(&drawn).raised("box", 1.5);
        assert_eq!(high.holds(&raised), drawn.chosen("side") == Some("left"), "{seed}");
    }
    let error = load(&text.replace("== \"left\"", "> \"left\"")).unwrap_err();
    assert!(error.contains("\"left\" is a text") && error.contains("(with side = left)"), "{error}");
}

#[test]
fn the_suite_is_whole() {
    assert!(!tandem_plus().is_empty());
    let set = TaskSet::default();
    for task in tandem_plus() {
        assert_eq!(task.source.name, format!("{}.toml", task.id));
        assert_eq!((task.suite(), set.find(&task.id).ok()), (Some(TANDEM_PLUS), Some(task)));
        assert!(crate::tasks::find(&task.id).is_err(), "{} is none of the ten", task.id);
        assert_eq!(EpisodeSpec::new(task, 0, Protocol::Benchmark).peculiarities()[0], "suite: tandem+");
        // Information for a single robot does not appear in an instruction that all robots receive.
        let shared = task.shared_instruction.as_ref().unwrap_or(&task.instruction);
        assert!(
            !shared.contains('[')
                && task.robots.iter().filter(|robot| robot.instruction.contains('[')).count() <= 1
        );
        // A user's file that differs from the suite's by one comment does not belong to the suite.
        let own = TaskSource { text: format!("# mine\n{}", task.source.text), ..task.source.clone() };
        assert_eq!(task_of(own).unwrap().suite(), None);
    }
}

#[test]
fn a_spec_holds_the_whole_file() {
    let task = load(FILE).unwrap();
    let spec = EpisodeSpec::new(&task, 3, Protocol::Benchmark);
    let text = serde_json::to_string(&spec).unwrap();
    let read: EpisodeSpec = serde_json::from_str(&text).unwrap();
    assert_eq!(read, spec);
    assert_eq!(read.peculiarities()[0], format!("task file: lift.toml {}", task.file_xxh3().unwrap()));
    let changed = text.replace("high_m = '0.03'", "high_m = '0.30'");
    assert_ne!(changed, text);
    let error = serde_json::from_str::<EpisodeSpec>(&changed).unwrap_err().to_string();
    assert!(error.contains("lift.toml is not the file that was recorded"), "{error}");
}

/// Each mistake is reported with its line and column.
#[test]
fn mistakes_are_told_by_their_places() {
    let check = |right: &str, wrong: &str, expected: &str| {
        assert!(FILE.contains(right), "{right}");
        let error = load(&FILE.replacen(right, wrong, 1)).expect_err(wrong);
        assert!(error.contains(expected), "{wrong}: {error}");
    };
    check("id = \"lift_it\"", "id = \"Lift it\"", "lift.toml:2:6: \"Lift it\" is no id of the task");
    check("\"floor\"", "\"flor\"", "lift.toml:3:9: no scene `flor`; have: dining_046");
    check("\"floor\"", "\"room.xml\"", "lift.toml:3:9: there is no room.xml beside");
    check("scene = \"floor\"\n", "", "no scene; give scene = \"floor\"");
    check("name = \"A\"", "name = \"R\"", "lift.toml:7:8: there are 1 to 3 [[robots]], called \"A\"");
    // Mistakes that merely follow from another are not reported.
    for (right, wrong) in [("name = \"A\"", "name = \"R\""), ("<freejoint/>", "<freejoint/><warp/>")] {
        let error = load(&FILE.replacen(right, wrong, 1)).unwrap_err();
        assert_eq!(error.matches("lift.toml").count(), 1, "{error}");
    }
    let room = "scene_mjcf = '''\n<mujoco>\n  <worldbody><wrap/></worldbody>\n</mujoco>'''";
    check("scene = \"floor\"", room, "lift.toml:5:3: wrap");
    check("[0, 0]", "[0, inf]", "at most 100 either way");
    check("[0, 0]", "[0]", "lift.toml:8");
    check(
        "instruction = \"Lift the box.\"\n\n[[objects",
        "instruction = \" \"\n\n[[objects",
        "nobody would know",
    );
    check("<freejoint/>", "<freejoint/><warp/>", "lift.toml:16");
    check("<geom type", "<geom mesh=\"m\" type", "lift.toml:16");
    check("mass=\"0.3\"/>", "mass=\"0.3\">", "lift.toml");
    check(
        "objects = [\"box\"]",
        "objects = [\"bx\"]",
        "lift.toml:20:12: no object \"bx\" to move; have: box",
    );
    check("x_m = 0.02", "x_m = [0.02, 0.01]", "ends before it begins; give [0.01, 0.02]");
    check("'0.03'", "'0.03 m'", "lift.toml:25:16: 'm' stands where");
    check("\"right\", \"box\"", "\"right\", \"bax\"", "lift.toml:26:29: no object \"bax\"; is it box?");
    check(">= high_m", ">= hihg_m", "no term \"hihg_m\" above this in [terms]; have: held, high_m");
    check("done = 'held", "don = 'held", "unknown field `don`");
    check(
        "done = 'held && lift_m(\"box\") >= high_m'",
        "done = '1 > 2'",
        "lift.toml:31:8: this can never hold",
    );
    check(
        "done = 'held && lift_m(\"box\") >= high_m'",
        "done = 'time_s() >= 0'",
        "this holds whatever happens",
    );
    check("done = 'held && lift_m(\"box\") >= high_m'", "first = 'held'", "a part of this phase is missing");
    check("broken = ", "at_end = ", "a phase is reached in one way");
    check("for_s = 0.5\n", "for_s = -1\n", "this may be 0 to 3600 seconds");
    check("id = \"carry\"", "id = \"lift\"", "there is a phase of this id already");
    check("near = 'coming(", "near = '!coming(", "something that holds or not is wanted");
    check("id = ", "id == ", "lift.toml:2:");
    check("position_m = [0.4", "file = \"box\"\nposition_m = [0.4", "given twice");
    // All occurrences are reported.
    let error = load(&FILE.replace("\"box\")", "\"bax\")")).unwrap_err();
    assert!(error.matches("no object \"bax\"").count() >= 4, "{error}");
}

#[test]
fn no_file_makes_it_panic() {
    let mut random = tandem_sim::SplitMix64(11);
    let marks = ["\"", "'", "[", "]", "=", "0", "-", "nan", "é", "\n", "x", "{", "1e400", "'''"];
    for _ in 0..400 {
        let at = random.uniform([0.0, FILE.len() as f32]) as usize % FILE.len();
        let mark = marks[random.uniform([0.0, marks.len() as f32]) as usize % marks.len()];
        let mut text = FILE.to_owned();
        if text.is_char_boundary(at) {
            text.replace_range(at..at + 1, mark);
        }
        let _ = load(&text);
    }
}

#[test]
fn files_beside_it_belong_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lift.toml");
    let text = FILE.replace("scene = \"floor\"", "scene = \"room.xml\"");
    std::fs::write(&path, &text).unwrap();
    let missing = read_task(&path).unwrap_err().to_string();
    assert!(missing.contains("room.xml"), "{missing}");
    let room = r#"<mujoco><worldbody><geom type="plane" size="5 5 1"/></worldbody></mujoco>"#;
    std::fs::write(folder.path().join("room.xml"), room).unwrap();
    let task = read_task(&path).unwrap();
    let text = serde_json::to_string(&EpisodeSpec::new(&task, 0, Protocol::Benchmark)).unwrap();
    drop(folder);
    let read: EpisodeSpec = serde_json::from_str(&text).unwrap();
    assert_eq!(read.task.scene_document, Some(Document::parse_alone("room.xml", room).unwrap().into()));
    let mesh = source(&text.replace("floor", "room.xml"));
    let with_mesh = TaskSource {
        text: FILE.replace("scene = \"floor\"", "scene = \"room.xml\""),
        beside: [("room.xml".into(), r#"<mujoco><include file="other.xml"/></mujoco>"#.into())].into(),
        ..mesh
    };
    let error = task_of(with_mesh).unwrap_err().to_string();
    assert!(error.contains("room.xml:1") && error.contains("names no other file"), "{error}");
}

/// Writes a house with a chest of drawers and a mug; the chest is a mesh in a separate file.
fn house() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("tent.obj", "v 0 0 0\nv 0.3 0 0\nv 0 0.3 0\nv 0 0 0.3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
    write(
        "house.xml",
        r#"<mujoco><asset><mesh name="tent" file="tent.obj"/></asset><worldbody>
          <geom type="plane" size="5 5 1"/>
          <body name="chest" pos="2 0 0"><geom type="mesh" mesh="tent"/>
            <body name="drawer"><joint type="slide" axis="0 1 0" range="-0.3 0"/>
              <geom type="box" size="0.1 0.1 0.1" pos="0 0 0.5"/></body>
            <body name="door"><joint type="hinge" axis="0 0 1" range="0 1.5"/>
              <geom type="box" size="0.1 0.1 0.1" pos="0 0 0.8"/></body>
          </body>
          <body name="Mug_1" pos="1 0 0.05"><freejoint/><geom type="box" size="0.05 0.05 0.05" mass="0.3"/></body>
        </worldbody></mujoco>"#,
    );
    folder
}

/// Returns the task of a file in the house whose objects and condition are these.
fn in_house(folder: &Path, objects: &str, done: &str) -> Result<Task, TaskFileError> {
    let text = FILE.replace("scene = \"floor\"", "scene = \"house.xml\"");
    let box_ = &text[text.find("[[objects]]").unwrap()..text.find("[terms]").unwrap()];
    let phases = &text[text.find("[terms]").unwrap()..];
    let one = "[[phases]]\nid = \"one\"\ndescription = \"It is done.\"\n";
    let text = text.replace(box_, objects).replace(phases, &format!("{one}done = '{done}'\n"));
    std::fs::write(folder.join("task.toml"), text).unwrap();
    read_task(&folder.join("task.toml"))
}

fn bodies(names: &[&str]) -> String {
    names.iter().map(|name| format!("[[objects]]\nname = \"{name}\"\nin_scene = true\n")).collect()
}

#[test]
fn bodies_of_the_scene_are_objects_once_they_are_named() {
    let house = house();
    let objects = bodies(&["drawer", "door", "Mug_1"]) + "[[randomize]]\nobjects = [\"Mug_1\"]\nx_m = 0.2\n";
    let done = r#"opened_m("drawer") > 0.1 && opened_deg("door") > 30 && lift_m("Mug_1") > 0.1"#;
    let task = in_house(house.path(), &objects, done).unwrap_or_else(|error| panic!("{error}"));
    let spec = EpisodeSpec::new(&task, 2000, Protocol::Benchmark);
    let session = crate::Session::start(&spec, None).unwrap();
    let before = session.facts();
    let by_m = task.start_poses(2000, Default::default())[2].position_m[0] - 1.0;
    assert!((before.position_m("Mug_1").x - 1.0 - by_m).abs() < 1e-6 && by_m.abs() > 1e-3, "{by_m}");
    assert_eq!((before.opened("drawer"), before.opened("door")), (0.0, 0.0));
    // The recorded task needs the files, unchanged.
    let text = serde_json::to_string(&spec).unwrap();
    assert!(!text.contains("freejoint"), "{text}");
    let read: EpisodeSpec = serde_json::from_str(&text).unwrap();
    assert_eq!(read.task, task);
    session.close();
    drop((read, task, spec));
    let tent = house.path().join("tent.obj");
    std::fs::write(&tent, std::fs::read_to_string(&tent).unwrap().replace("0.3", "0.4")).unwrap();
    let error = serde_json::from_str::<EpisodeSpec>(&text).unwrap_err().to_string();
    assert!(error.contains("house.xml has changed"), "{error}");
}

#[test]
fn what_cannot_be_an_object_of_the_scene_is_refused_in_words() {
    let house = house();
    let lifted = r#"lift_m("Mug_1") > 0.1"#;
    let moved = |name: &str| format!("[[randomize]]\nobjects = [\"{name}\"]\nx_m = 0.2\n");
    let own = "[[objects]]\nname = \"door\"\nfile = \"cup\"\nposition_m = [0, 0, 1]\n";
    for (objects, done, expected) in [
        (bodies(&["mug"]), lifted, "no body \"mug\" that can move; have: chest, drawer, door, Mug_1"),
        (bodies(&["Mug_1", "drawer"]) + &moved("drawer"), lifted, "drawer is not free"),
        (bodies(&["Mug_1"]) + "position_m = [0, 0, 1]\n", lifted, "the scene has this body and its place"),
        (bodies(&["Mug_1"]) + own, lifted, "the scene has a body \"door\"; in_scene = true"),
        (bodies(&["Mug_1"]) + "[[objects]]\nname = \"cup\"\n", lifted, "no place; give position_m"),
        (bodies(&["Mug_1"]), r#"opened_m("Mug_1") > 0.1"#, "no object with a slide \"Mug_1\""),
        (bodies(&["drawer", "door"]), r#"opened_deg("drawer") > 1"#, "no object with a hinge \"drawer\""),
        (bodies(&["door"]), r#"opened_deg("door") > 200"#, "never"),
    ] {
        let error = in_house(house.path(), &objects, done).unwrap_err().to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
}
