//! Invariants of the repository itself: file length, crate arrows, a purpose at the top of each file.

use std::{
    fs,
    path::{Path, PathBuf},
};

const LONGEST_LINES: usize = 600;

/// Which crates of the workspace each crate may depend on. `sim`, `ik` and `tools_spec` know nothing of each other.
const ARROWS: &[(&str, &[&str])] = &[
    ("tools_spec", &[]),
    ("ik", &[]),
    ("sim", &[]),
    ("episodes", &["tandem-sim", "tandem-ik", "tandem-tools-spec"]),
    ("gateway", &["tandem-episodes", "tandem-tools-spec"]),
    ("tests", &["tandem", "tandem-episodes", "tandem-ik", "tandem-sim", "tandem-tools-spec"]),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace").into()
}

/// Every file below `folder` with one of the `extensions`, build outputs and hidden folders left out.
fn files(folder: &Path, extensions: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("an entry of a folder").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() {
            if !name.starts_with('.') && !["target", "runs", "node_modules"].contains(&name.as_str()) {
                files(&path, extensions, found);
            }
        } else if path
            .extension()
            .is_some_and(|extension| extensions.iter().any(|wanted| extension == *wanted))
        {
            found.push(path);
        }
    }
}

fn sources(extensions: &[&str]) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    files(&root(), extensions, &mut found);
    assert!(found.len() > 20, "only {} files found below {}", found.len(), root().display());
    found
        .into_iter()
        .map(|path| {
            let text =
                fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            (path, text)
        })
        .collect()
}

fn expect_none(wrong: Vec<String>, rule: &str) {
    assert!(wrong.is_empty(), "{rule}:\n  {}", wrong.join("\n  "));
}

#[test]
fn no_source_file_is_too_long() {
    let too_long = sources(&["rs", "py", "sh", "toml"])
        .into_iter()
        .map(|(path, text)| (path, text.lines().count()))
        .filter(|(_, lines)| *lines > LONGEST_LINES)
        .map(|(path, lines)| format!("{}: {lines}", path.display()))
        .collect();
    expect_none(too_long, "no source file has more than 600 lines; split it by purpose");
}

#[test]
fn most_source_files_are_short() {
    let mut lengths: Vec<usize> = sources(&["rs"]).iter().map(|(_, text)| text.lines().count()).collect();
    lengths.sort_unstable();
    let median = lengths[lengths.len() / 2];
    assert!(median <= 200, "half of the source files have more than {median} lines; 150 is what we aim at");
}

#[test]
fn every_file_says_what_it_is_for() {
    let silent = sources(&["rs"])
        .into_iter()
        .filter(|(_, text)| !text.starts_with("//! "))
        .map(|(path, _)| path.display().to_string())
        .collect();
    expect_none(silent, "every Rust file begins with `//!` and its purpose");
}

#[test]
fn no_file_points_out_of_the_repository() {
    let outside = concat!("../", "shared");
    let pointing = sources(&["rs", "py", "sh", "toml", "md", "xml"])
        .into_iter()
        .filter(|(_, text)| text.contains(outside))
        .map(|(path, _)| path.display().to_string())
        .collect();
    expect_none(pointing, "everything a file names is in the repository");
}

#[test]
fn crates_depend_along_the_arrows() {
    for (member, allowed) in ARROWS {
        let path = root().join(member).join("Cargo.toml");
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let manifest: toml::Table =
            text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        for section in ["dependencies", "dev-dependencies", "build-dependencies"] {
            let names =
                manifest.get(section).and_then(toml::Value::as_table).into_iter().flat_map(toml::Table::keys);
            let ours = names.filter(|name| *name == "tandem" || name.starts_with("tandem-"));
            for name in ours {
                assert!(
                    allowed.contains(&name.as_str()),
                    "{member} must not depend on {name}; it may on {allowed:?}"
                );
            }
        }
    }
}

#[test]
fn the_arrows_name_every_member() {
    let text = fs::read_to_string(root().join("Cargo.toml")).expect("the workspace's manifest");
    let manifest: toml::Table = text.parse().expect("TOML");
    let mut members: Vec<&str> = manifest["workspace"]["members"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(toml::Value::as_str)
        .collect();
    let mut named: Vec<&str> = ARROWS.iter().map(|(member, _)| *member).collect();
    members.sort_unstable();
    named.sort_unstable();
    assert_eq!(named, members);
}
