//! Tests of checked tasks: objects at rest, falling objects, and phases that need no action.

use tandem_episodes::tasks::{TaskSource, task_of};

use super::*;

/// Returns a task with a box on the floor, one robot, and two phases with these conditions.
fn task(z_m: f32, conditions: [&str; 2]) -> Task {
    let [first, second] = conditions;
    let text = format!(
        r#"
id = "box"
scene = "floor"
instruction = "Lift the box."
[[robots]]
name = "A"
position_m = [0, 0]
instruction = "Lift the box."
[[objects]]
name = "box"
position_m = [1, 0, {z_m}]
mjcf = '<mujoco><worldbody><body name="box"><freejoint/><geom type="box" size="0.05 0.05 0.05" mass="0.3"/></body></worldbody></mujoco>'
[[phases]]
id = "one"
description = "It is lifted."
done = '{first}'
[[phases]]
id = "two"
description = "It is left."
done = '{second}'
"#
    );
    let source = TaskSource { name: "box.toml".into(), text, ..TaskSource::default() };
    task_of(source).unwrap_or_else(|error| panic!("{error}"))
}

const LIFTED: &str = r#"lift_m("box") >= 0.03"#;

#[test]
fn what_stands_is_drawn_from_every_camera() {
    let folder = tempfile::tempdir().unwrap();
    let check =
        check_task(&task(0.05, [LIFTED, r#"hands_off("A", "box")"#]), &[0, 1], Some(folder.path())).unwrap();
    assert_eq!(check.falls, Vec::<String>::new());
    assert!(check.notes.len() == 1 && check.notes[0].contains("p2 two"), "{:?}", check.notes);
    let names: Vec<_> = check.pictures.iter().filter_map(|path| path.file_name()?.to_str()).collect();
    assert_eq!(names, ["start_third_person.png", "start_A.png"]);
    for path in &check.pictures {
        assert_eq!(&std::fs::read(path).unwrap()[1..4], b"PNG");
    }
}

#[test]
fn what_falls_is_named() {
    let check = check_task(&task(0.5, [LIFTED, LIFTED]), &[3, 4, 5], None).unwrap();
    let [line] = &check.falls[..] else { panic!("{:?}", check.falls) };
    let told = "seed 3: box does not stay at (1.00, 0.00, 0.50): within 2 s it comes to (1.00, 0.00, 0.05)";
    assert!(line.starts_with(told) && line.ends_with("(so it is with 2 other seeds, too)"), "{line}");
}

#[test]
fn what_is_in_a_robots_way_is_named() {
    let table = r#"<mujoco><worldbody><geom type="plane" size="5 5 1"/>
        <geom type="box" size="0.3 0.3 0.02" pos="0.25 0 0.7"/></worldbody></mujoco>"#;
    let mut source = task(0.05, [LIFTED, LIFTED]).source.clone();
    source.text = source.text.replace("scene = \"floor\"", &format!("scene_mjcf = '''{table}'''"));
    let check = check_task(&task_of(source).unwrap(), &[0], None).unwrap();
    let told = check.falls.iter().find(|line| line.contains("robot A")).expect("it stands in a table");
    assert!(told.contains(": first its ") && told.contains("presses on the room, at (0."), "{told}");
}

#[test]
fn what_robots_keep_from_each_other_is_not_told_elsewhere() {
    let text = |joint: &str, description: &str| {
        format!(
            r#"
id = "which_way"
scene = "floor"
{joint}
[[choices]]
name = "way"
options = ["left", "right"]
[[robots]]
name = "A"
position_m = [0, 0]
instruction = "Send B to the {{way}}."
[[robots]]
name = "B"
position_m = [2, 0]
instruction = "Go where A sends you."
[[phases]]
id = "gone"
description = "{description}"
done = '"{{way}}" == "left" ? time_s() > 100 : time_s() > 200'
"#
        )
    };
    let notes = |joint: &str, description: &str| {
        let source =
            TaskSource { name: "way.toml".into(), text: text(joint, description), ..TaskSource::default() };
        let task = task_of(source).unwrap_or_else(|error| panic!("{error}"));
        check_task(&task, &[0], None).unwrap().notes
    };
    let kept = "instruction = \"Go to the {way}.\"\nshared_instruction = \"Go where A sends you.\"";
    assert_eq!(notes(kept, "B is there."), Vec::<String>::new());
    let told = notes("instruction = \"Go to the {way}.\"", "B is on the {way}.");
    let [joint, phase] = &told[..] else { panic!("{told:?}") };
    assert!(joint.contains("own instruction of B") && joint.contains("give shared_instruction"), "{joint}");
    assert!(phase.contains("the description of p1 gone"), "{phase}");
    // The same applies to rewordings.
    let words = |to_a: &str, to_b: &str| {
        let words = format!(
            "[[rewordings]]\ninstruction = \"Off to the {{way}}.\"\nshared_instruction = \"Off as A says.\"\n\
             robots.A = \"{to_a}\"\nrobots.B = \"{to_b}\"\n"
        );
        notes(&format!("{kept}\n{}", words.repeat(3)), "B is there.")
    };
    assert_eq!(words("Off to the {way} with B.", "Off with you as A says."), Vec::<String>::new());
    for (to_a, to_b) in [("Off to the {way}.", "Off to the {way}."), ("Off with B.", "Off with you.")] {
        let told = words(to_a, to_b);
        assert!(told.len() == 3 && told[0].starts_with("[[rewordings]] number 1 do not tell"), "{told:?}");
    }
}

#[test]
fn a_phase_that_nobody_has_to_work_for_is_refused() {
    let error = check_task(&task(0.05, [r#"released_for_s("box") >= 0.2"#, LIFTED]), &[0], None).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("box: phase one is reached 0.2") && text.contains("nobody has acted"), "{text}");
}
