//! Tests of conditions, valid and invalid.

use tandem_sim::{ObjectFile, OpeningKind};

use super::*;
use crate::scoring::{A, Facts, Grip, Predicate};
use crate::tasks;

/// Returns the names of Handover: two robots and its objects.
fn names() -> Names {
    let task = tasks::find("handover").unwrap();
    let parts = task.objects.iter().flat_map(|spot| ObjectModel::parts(&spot.source, &spot.name).unwrap());
    Names {
        robots: task.robot_names().map(str::to_owned).collect(),
        objects: parts.map(|part| (part.name, Arc::new(part.model))).collect(),
        ..Names::default()
    }
}

/// Returns the same names, with a bottle that a joint of this kind carries.
fn names_with_joint(kind: OpeningKind) -> Names {
    let joint = match kind {
        OpeningKind::Hinge => "hinge",
        OpeningKind::Slide => "slide",
    };
    let mjcf = format!(
        r#"<mujoco><worldbody><body name="post"><geom size="0.1"/><body name="leaf">
          <joint type="{joint}" axis="0 0 1" range="0 1"/><geom size="0.1" pos="0 0 0.5"/></body></body></worldbody></mujoco>"#
    );
    let post = ObjectFile::Text { name: "post.xml".into(), mjcf };
    let parts = ObjectModel::parts(&post, "post").unwrap();
    let leaf = parts.into_iter().find(|part| part.model.opening.is_some()).unwrap();
    let mut names = names();
    names.objects.insert("bottle".into(), Arc::new(leaf.model));
    names
}

fn rest() -> Facts {
    Facts::at_rest(&tasks::find("handover").unwrap())
}

#[test]
fn conditions_hold_as_they_are_written() {
    let held = rest().grip(A, tandem_sim::Side::Right, "bottle", Grip::Holding);
    let check = |text: &str, expected: bool| {
        let truth = condition(text, &names()).unwrap_or_else(|mistake| panic!("{text}: {mistake:?}"));
        assert_eq!(truth.holds(&held), expected, "{text}");
    };
    check(r#"holds("A", "right", "bottle")"#, true);
    check(r#"holds('A', 'left', 'bottle')"#, false);
    check(r#"!holds_any("B", "bottle") && lift_m("bottle") < 0.01"#, true);
    check(r#"held_by_all(["A", "B"], "bottle")"#, false);
    check(r#"hands_off("A", "bottle") || fallen("B")"#, false);
    check(r#"upright_deg("bottle") <= 15 && released_for_s("bottle") < 0.2"#, true);
    check(r#"z_m("bottle") == z_m("target_pad")"#, true);
    // Weaker operators bind later, and equal ones associate to the left.
    check("1 + 2 * 3 == 7 && time_s() > 1", true);
    check("10 - 4 - 3 == 3 && 12 / 2 / 3 == 2 && time_s() > 1", true);
    check("true || false && time_s() < 0", true);
    check("(true || false) && time_s() < 0", false);
    check("-time_s() < -1 && !(time_s() < 1)", true);
    check("time_s() > 1 ? fallen(\"A\") : true", false);
    check("(time_s() > 1) == !fallen(\"A\") // as nobody has fallen", true);
    check("min(time_s(), 3) == 3 && max(1, 2) == 2 && abs(-2) == 2", true);
    check("1e-3 < time_s() / 1.5E1", true);
}

#[test]
fn readers_get_five_digits_of_a_number() {
    let check = |text: &str, expected: &str| assert_eq!(readable(text), expected);
    check("opened_deg  >=\n 83.07888029396936", "opened_deg >= 83.079");
    check(
        "tilt_rad(\"cup_2\") <= 0.0005235987755982988e1 && 1.45 > 0.03",
        "tilt_rad(\"cup_2\") <= 0.0005236e1 && 1.45 > 0.03",
    );
    let [part] = &parts("time_s() >= 83.07888029396936", 0, &names()).unwrap()[..] else {
        panic!("one part")
    };
    let at_s = |time_s: f64| part.truth.holds(&Facts { time_s, ..rest() });
    assert!(!at_s(83.078_88) && at_s(83.078_881), "the condition itself is not rounded");
}

#[test]
fn mistakes_say_where_and_what_would_be_right() {
    let check = |text: &str, at: &str, says: &str| {
        let mistake = condition(text, &names()).expect_err(text);
        assert!(mistake.text.contains(says), "{text}: {}", mistake.text);
        let found = text.get(mistake.at.clone()).unwrap_or_default();
        assert_eq!(found, at, "{text}: {mistake:?}");
    };
    check(
        r#"lift_m("botle") > 1"#,
        r#""botle""#,
        "no object \"botle\"; is it bottle?; have: bottle, target_pad",
    );
    check(r#"lift("bottle") > 1"#, "lift", "no fact \"lift\"; is it lift_m?; have: holds");
    check(r#"holds("D", "right", "bottle")"#, r#""D""#, "have: A, B");
    check(r#"holds("A", "up", "bottle")"#, r#""up""#, "have: left, right");
    check(r#"holds("A", "bottle")"#, r#"holds("A", "bottle")"#, "holds(robot, side, object)");
    check(r#"site_radius_m("bottle", "foot") > 1"#, r#""foot""#, "have: grip_low, grip_high");
    check(r#"lift_m(bottle) > 1"#, "bottle", "an object's name in quotes");
    check(r#"lift_m("bottle")"#, r#"lift_m("bottle")"#, "compare it");
    check(r#"lift_m("bottle") > true"#, "true", "a number is wanted");
    check(r#"0 < lift_m("bottle") < 1"#, r#"0 < lift_m("bottle")"#, "a < b && b < c");
    check(r#"lift_m("bottle") = 1"#, "=", "equal is ==");
    check(r#"fallen("A") and fallen("B")"#, "a", "an operator");
    check(r#"fallen("A") & fallen("B")"#, "&", "and is &&");
    check(r#"(fallen("A")"#, "", "ends where a ')'");
    check(r#"fallen("A"#, "\"", "no closing");
    check("bottle.lift > 1", ".", "facts are functions");
    check("lift_m > 1", "lift_m", "lift_m(object)");
    check("heigth > 1", "heigth", "no term \"heigth\"");
    check("3cm > 1", "3", "no number");
    check("", "", "the expression ends where");
    check("\"bottle\"", "\"bottle\"", "texts stand in the brackets of facts, as in lift_m");
    check("é", "é", "a condition or a number is expected");
    check("[1, 2]", "[1, 2]", "a list stands only");
    check("mean([]) > 1", "[]", "a list as");
    check(&"(".repeat(300), "(", "stand within each other");
    check(&"!".repeat(300), "!", "stand within each other");
}

#[test]
fn no_text_makes_it_panic() {
    let pieces = [
        "holds", "(", ")", "\"A\"", ",", "&&", "||", "!", "-", "1", ".", "e", "[", "]", "é", "?", ":", "'",
        "<", "\n", "//",
    ];
    let mut random = tandem_sim::SplitMix64(7);
    let names = names();
    for _ in 0..20_000 {
        let length = random.uniform([0.0, 12.0]) as usize;
        let piece = |_| pieces[random.uniform([0.0, pieces.len() as f32]) as usize % pieces.len()];
        let text: String = (0..length).map(piece).collect();
        if let Ok(truth) = condition(&text, &names) {
            truth.holds(&rest());
        }
    }
}

#[test]
fn what_nothing_in_the_world_can_change_is_found() {
    let check = |text: &str, expected: Option<bool>| {
        assert_eq!(condition(text, &names()).unwrap().always(), expected, "{text}");
    };
    check("1 < 2", Some(true));
    check(r#"upright_deg("bottle") > 200"#, Some(false));
    check(r#"upright_deg("bottle") >= 0"#, Some(true));
    check(r#"upright_deg("bottle") < 15"#, None);
    check(r#"released_for_s("bottle") < 0 || fallen("A")"#, None);
    check(r#"released_for_s("bottle") < 0 && fallen("A")"#, Some(false));
    check(r#"!(apart_m("bottle", "target_pad") >= 0)"#, Some(false));
    check(r#"turned_deg("bottle", "target_pad") * 2 <= 360"#, Some(true));
    check(r#"grip("A", "left", "bottle") + 1 > 2.5"#, Some(false));
    check(r#"1 / lift_m("bottle") > 1"#, None);
}

/// Every row of the list has the types that it declares; a mismatch would panic only at its first use.
#[test]
fn every_fact_can_be_asked_for_and_is_what_it_says() {
    for function in FUNCTIONS {
        let argument = |parameter: &functions::Parameter| match parameter {
            functions::Parameter::Robot => "'A'",
            functions::Parameter::Robots => "['A', 'B']",
            functions::Parameter::Side => "'left'",
            functions::Parameter::Object | functions::Parameter::Opening(_) => "'bottle'",
            functions::Parameter::Site { .. } => "'grip_low'",
            functions::Parameter::Number(_) => "1",
            functions::Parameter::Numbers => "[1, 2]",
            functions::Parameter::Truth => "true",
        };
        let joint = function.parameters.iter().find_map(|parameter| match parameter {
            functions::Parameter::Opening(kind) => Some(*kind),
            _ => None,
        });
        let names = joint.map_or_else(names, names_with_joint);
        let arguments: Vec<&str> = function.parameters.iter().map(argument).collect();
        let text = format!("{}({})", function.name, arguments.join(", "));
        match term(&text, &names).unwrap_or_else(|mistake| panic!("{text}: {mistake:?}")) {
            Meaning::Truth(truth) => {
                let nearness = truth.nearness(&rest());
                assert!((0.0..=1.0).contains(&nearness) && truth.always().is_none(), "{text}: {nearness}");
            }
            Meaning::Number(number) => {
                let (value, [low, high]) = (number.value(&rest()), number.range());
                assert!(low <= value && value <= high, "{text}: {value}");
            }
        }
        assert!(!function.help.is_empty(), "{}", function.name);
    }
}

#[test]
fn the_book_lists_every_fact() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/src/task-files.md");
    let page = std::fs::read_to_string(page).unwrap();
    for function in FUNCTIONS {
        let row = format!("| `{}` | {} |", function.signature(), function.help);
        assert!(page.contains(&row), "the table of facts in docs/src/task-files.md has no row {row}");
    }
}

#[test]
fn terms_stand_for_what_they_mean_and_cannot_grow_without_end() {
    let mut names = names();
    let lifted = term(r#"lift_m("bottle") >= height_m"#, &names).unwrap_err();
    assert!(lifted.text.contains("no term \"height_m\" above this"), "{}", lifted.text);
    for (name, text) in [("height_m", "0.03"), ("lifted", r#"lift_m("bottle") >= height_m"#)] {
        let meaning = term(text, &names).unwrap();
        names.terms.insert(name.into(), meaning);
    }
    assert!(!condition("lifted", &names).unwrap().holds(&rest()));
    assert!(condition("!lifted && height_m < 1", &names).unwrap().holds(&rest()));
    let mut doubled = "lifted".to_owned();
    let grown = (0..40).find_map(|index| {
        let meaning = term(&format!("{doubled} && {doubled}"), &names);
        doubled = format!("twice_{index}");
        match meaning {
            Ok(meaning) => drop(names.terms.insert(doubled.clone(), meaning)),
            Err(mistake) => return Some(mistake),
        }
        None
    });
    assert!(grown.expect("a limit").text.contains("parts"));
}
