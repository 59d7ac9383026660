//! Tests of the documents' links, of the table of contents, and of README's length.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::pages::{BOOK, CONTENTS, Page, all_documents, page, pages, paths_below, root};

/// Maximum number of lines of README; details belong in the book.
const README_LINES: usize = 150;

/// Folder of the API references, which `.ci/site` adds to the built book and whose links it checks.
const REFERENCES: &str = "api/";

/// Returns the links of a page with their lines.
fn links(page: &Page) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (line, text) in page.prose() {
        let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        found.extend(targets.map(|target| (line, target.to_owned())));
    }
    found
}

/// Returns the anchor of a heading by the rules of GitHub and mdBook.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().chars().filter(|letter| letter.is_alphanumeric() || " -_".contains(*letter));
    kept.map(|letter| if letter == ' ' { '-' } else { letter.to_ascii_lowercase() }).collect()
}

fn has_anchor(path: &Path, wanted: &str) -> bool {
    let text = fs::read_to_string(path).expect("a page that is there");
    let headings = text.lines().filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#'))).any(|anchor| anchor == wanted)
}

/// Returns the reason why a link is broken; `None` for a valid one.
fn broken(page: &Page, target: &str) -> Option<String> {
    if target.starts_with("https://") || page.path.starts_with(BOOK) && target.starts_with(REFERENCES) {
        return None;
    }
    let (file, wanted) = target.split_once('#').unwrap_or((target, ""));
    let own = root().join(&page.path);
    let path = match file {
        "" => own.clone(),
        file => own.parent().expect("the folder of a page").join(file),
    };
    let Ok(path) = path.canonicalize() else { return Some("nothing is there".into()) };
    let book = root().join(BOOK).canonicalize().expect("the book's folder");
    if page.path.starts_with(BOOK) && !path.starts_with(&book) {
        return Some("pages of the book link to nothing outside of it; name the file instead".into());
    }
    match wanted.is_empty() || has_anchor(&path, wanted) {
        true => None,
        false => Some(format!("it has no heading {wanted:?}")),
    }
}

#[test]
fn links_lead_somewhere() {
    let mut wrong = Vec::new();
    for page in all_documents() {
        for (line, target) in links(&page) {
            let reason = broken(&page, &target);
            wrong.extend(reason.map(|reason| format!("{}: {target}: {reason}", page.at(line))));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns true if a word in backticks is a path in this repository. Paths of evaluation results have
/// parts in capitals.
fn is_own_path(word: &str) -> bool {
    let folders = ["docs/", "episodes/", "gateway/", "ik/", "sim/", "tests/", "tools_spec/"];
    let begins = folders.iter().any(|folder| word.starts_with(folder));
    begins && !word.contains(' ') && !word.contains("TASK")
}

#[test]
fn files_that_are_named_are_there() {
    let mut wrong = Vec::new();
    for page in all_documents() {
        for (line, word) in page.in_backticks().into_iter().filter(|(_, word)| is_own_path(word)) {
            let known = word.split('*').next().unwrap_or(&word);
            if !root().join(known).exists() {
                wrong.push(format!("{}: there is no {word}", page.at(line)));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_page_is_in_the_table_of_contents_and_every_picture_on_a_page() {
    let contents = page(&format!("{BOOK}/{CONTENTS}"));
    let folder = root().join(BOOK);
    let listed: Vec<PathBuf> = links(&contents).into_iter().map(|(_, target)| folder.join(target)).collect();
    for path in paths_below(&folder).iter().filter(|path| !path.ends_with(CONTENTS)) {
        let count = listed.iter().filter(|listed| *listed == path).count();
        assert_eq!(count, 1, "{CONTENTS} lists {} {count} times", path.display());
    }
    let targets: Vec<String> = pages().iter().flat_map(links).map(|(_, target)| target).collect();
    for entry in fs::read_dir(folder.join("pictures")).expect("pictures") {
        let name = entry.expect("a picture").file_name().to_string_lossy().into_owned();
        assert!(
            targets.iter().any(|target| target.ends_with(&format!("pictures/{name}"))),
            "no page shows {name}"
        );
    }
}

#[test]
fn readme_is_short() {
    let lines = page("README.md").text.lines().count();
    assert!(
        lines <= README_LINES,
        "README.md has {lines} lines; what is beyond {README_LINES} belongs into the book"
    );
}

#[test]
fn headings_are_called_as_in_addresses() {
    assert_eq!(anchor(" What the experts reach"), "what-the-experts-reach");
    assert_eq!(anchor(" Physics, and what is approximate"), "physics-and-what-is-approximate");
}
