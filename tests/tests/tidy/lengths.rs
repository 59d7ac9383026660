//! How long files are.

use super::sources::{everywhere, expect_none};

const LONGEST_LINES: usize = 500;
const MEDIAN_LINES: usize = 130;

#[test]
fn no_source_file_is_too_long() {
    let too_long: Vec<String> = everywhere(&["rs", "py", "sh", "toml"])
        .into_iter()
        .map(|source| (source.path, source.text.lines().count()))
        .filter(|(_, lines)| *lines > LONGEST_LINES)
        .map(|(path, lines)| format!("{}: {lines}", path.display()))
        .collect();
    expect_none(&too_long, &format!("no file has more than {LONGEST_LINES} lines; split it by purpose"));
}

#[test]
fn most_source_files_are_short() {
    let mut lengths: Vec<(usize, String)> = everywhere(&["rs"])
        .into_iter()
        .map(|source| (source.text.lines().count(), source.path.display().to_string()))
        .collect();
    lengths.sort();
    let (median, _) = lengths[lengths.len() / 2];
    let longest: Vec<String> =
        lengths.iter().rev().take(10).map(|(lines, path)| format!("{path}: {lines}")).collect();
    assert!(
        median <= MEDIAN_LINES,
        "half of the Rust files have {median} lines or more, {MEDIAN_LINES} is the most; begin with the longest:\n  {}",
        longest.join("\n  ")
    );
}
