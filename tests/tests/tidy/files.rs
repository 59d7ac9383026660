//! Tests of the number of files in each folder, and of texts that every file must or must not contain.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use super::sources::{everywhere, expect_none, files, root};

const MAX_FILES: usize = 12;

/// Heading in ARCHITECTURE.md of the table that justifies larger folders.
const REASONS: &str = "## Folders with more than twelve files";

/// Returns the folders in the table under [`REASONS`], whose rows are "| `folder` | reason |".
fn with_reason(text: &str) -> BTreeSet<&str> {
    let section = text.split(REASONS).nth(1).unwrap_or_default();
    let section = section.split("\n## ").next().unwrap_or_default();
    let rows = section.lines().filter_map(|row| row.strip_prefix("| `")?.split_once("` | "));
    rows.filter(|(_, reason)| reason.trim_end_matches('|').trim() != "").map(|(folder, _)| folder).collect()
}

/// Returns the violations of the limit on files in these folders.
fn crowded(counts: &BTreeMap<String, usize>, reasons: &BTreeSet<&str>) -> Vec<String> {
    let many = |folder: &str| counts.get(folder).is_some_and(|count| *count > MAX_FILES);
    let unexplained =
        counts.iter().filter(|(folder, count)| **count > MAX_FILES && !reasons.contains(folder.as_str()));
    let unexplained = unexplained.map(|(folder, count)| format!("{folder}: {count} files"));
    let needless = reasons.iter().filter(|folder| !many(folder));
    unexplained.chain(needless.map(|folder| format!("{folder} needs no reason (any more)"))).collect()
}

#[test]
fn folders_are_small() {
    let architecture = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let mut counts = BTreeMap::new();
    for file in files("") {
        let folder = file.parent().unwrap_or(Path::new("")).to_string_lossy().into_owned();
        *counts.entry(folder).or_default() += 1;
    }
    let rule = format!(
        "a folder has at most {MAX_FILES} files; group them, merge what belongs together, or, where one file stands for one \
         thing, say so in ARCHITECTURE.md under {REASONS:?}"
    );
    expect_none(&crowded(&counts, &with_reason(&architecture)), &rule);
}

#[test]
fn crowded_folders_are_found() {
    let check = |count: usize, table: &str, expected: usize| {
        let text = format!(
            "# Map\n| `a` | no reason for this |\n{REASONS}\n\n| Folder | Why |\n|---|---|\n{table}\n## Next\n"
        );
        let found = crowded(&BTreeMap::from([("a".into(), count)]), &with_reason(&text));
        assert_eq!(found.len(), expected, "{count} files, {table:?}: {found:?}");
    };
    check(MAX_FILES, "", 0);
    check(MAX_FILES + 1, "", 1);
    check(MAX_FILES + 1, "| `a` | one file a letter |", 0);
    check(MAX_FILES + 1, "| `a` |  |", 1);
    check(MAX_FILES, "| `a` | one file a letter |", 1);
    check(MAX_FILES, "| `b` | gone |", 1);
}

#[test]
fn every_file_says_what_it_is_for() {
    let silent: Vec<String> = everywhere(&["rs"])
        .into_iter()
        .filter(|source| !source.text.starts_with("//! "))
        .map(|source| source.path.display().to_string())
        .collect();
    expect_none(&silent, "every Rust file begins with `//!` and its purpose");
}

#[test]
fn no_file_points_out_of_the_repository() {
    let outside = concat!("../", "shared");
    let pointing: Vec<String> = everywhere(&["rs", "py", "sh", "toml", "md", "xml"])
        .into_iter()
        .filter(|source| source.text.contains(outside))
        .map(|source| source.path.display().to_string())
        .collect();
    expect_none(&pointing, "everything a file names is in the repository");
}

#[test]
fn what_tests_leave_out_is_not_printed_where_nobody_sees_it() {
    let print = ["println!(\"skipped", "eprintln!(\"skipped"];
    let hidden: Vec<String> = everywhere(&["rs"])
        .into_iter()
        .filter(|source| print.iter().any(|print| source.text.contains(print)))
        .map(|source| source.path.display().to_string())
        .collect();
    expect_none(&hidden, "a test says what it leaves out through tests/src/skipped.rs");
}
