//! Tests of the masses in the documents against the object files.

use std::fs;

use tandem_episodes::tasks::{self, ObjectSpot};
use tandem_sim::{ObjectModel, ObjectPart, assets};

use super::pages::{BOOK, page, root};

#[test]
fn documents_weigh_objects_as_their_files_do() {
    for task in tasks::cohub() {
        let parts =
            |spot: &ObjectSpot| ObjectModel::parts(&spot.source, &spot.name).expect("an object of a task");
        let file = |spot: &ObjectSpot| assets::object(&spot.file).expect("an object of a task");
        let all: Vec<ObjectPart> = task.objects.iter().flat_map(parts).collect();
        let whole_kg = |spot: &ObjectSpot| parts(spot).iter().map(|part| part.model.mass_kg).sum();
        let mut masses_kg: Vec<f32> = all.iter().map(|part| part.model.mass_kg).collect();
        masses_kg.extend(task.objects.iter().map(whole_kg));
        let page = page(&format!("{BOOK}/tasks/{}.md", task.id)).text;
        let source = fs::read_to_string(root().join(format!("episodes/tasks/cohub/{}.toml", task.id)));
        let source = source.expect("the file of a task");
        let header: String = source.lines().map_while(|line| line.strip_prefix("#")).collect();
        for stated in stated_kg(&header) {
            let known = masses_kg.iter().any(|mass_kg| stated.is(*mass_kg));
            assert!(known, "the file of {} says {} kg; objects have {masses_kg:?}", task.id, stated.text);
        }
        for spot in &task.objects {
            let weighed = format!("`{}`", spot.name);
            let row = page.lines().find(|line| line.starts_with("| `") && line.contains(&weighed));
            let cell = row.and_then(|row| row.trim_end_matches(['|', ' ']).rsplit('|').next());
            if let [stated] = &stated_kg(cell.unwrap_or_default())[..] {
                let mass_kg = whole_kg(spot);
                assert!(stated.is(mass_kg), "{}: {} kg, and not {mass_kg} kg", spot.name, stated.text);
            }
            // Also checks the comments in the object's file.
            let file = file(spot);
            for (end, _) in file.match_indices(" kg in all") {
                let stated = Kilograms::read(file[..end].rsplit(' ').next().unwrap_or_default());
                let mass_kg = whole_kg(spot);
                assert!(
                    stated.is_some_and(|stated| stated.is(mass_kg)),
                    "{}.xml: not {mass_kg} kg",
                    spot.file
                );
            }
        }
    }
}

/// A mass stated in a text, with its number of digits.
struct Kilograms {
    text: String,
    kg: f32,
}

impl Kilograms {
    fn read(text: &str) -> Option<Kilograms> {
        Some(Kilograms { text: text.into(), kg: text.parse().ok()? })
    }

    /// Returns true if the text states this mass, rounded.
    fn is(&self, mass_kg: f32) -> bool {
        let digits = self.text.split_once('.').map_or(0, |(_, digits)| digits.len());
        (self.kg - mass_kg).abs() <= 0.501 * 0.1_f32.powi(digits as i32)
    }
}

/// Returns every mass stated in a text.
fn stated_kg(text: &str) -> Vec<Kilograms> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let pairs = words.windows(2).filter(|pair| pair[1].trim_matches(|c: char| !c.is_alphanumeric()) == "kg");
    pairs.filter_map(|pair| Kilograms::read(pair[0].trim_start_matches('('))).collect()
}

#[test]
fn masses_are_read_as_they_are_rounded() {
    let stated = stated_kg("a frame of 2.6 kg, a trolley of 13\nkg (1.50 kg): 4 m");
    let texts: Vec<&str> = stated.iter().map(|stated| stated.text.as_str()).collect();
    assert_eq!(texts, ["2.6", "13", "1.50"]);
    for (stated, mass_kg, expected) in [
        ("2.6", 2.64, true),
        ("2.6", 2.66, false),
        ("13", 12.6, true),
        ("13", 12.4, false),
        ("1.50", 1.51, false),
    ] {
        assert_eq!(Kilograms::read(stated).expect("a number").is(mass_kg), expected, "{stated} {mass_kg}");
    }
}
