//! What every file has to say, and must not.

use super::sources::{everywhere, expect_none};

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
