//! Tests of the dependencies between crates.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use super::sources::{expect_none, root};

/// Allowed dependencies of each crate in the workspace. `sim`, `ik` and `tools_spec` are independent of
/// each other.
const ARROWS: &[(&str, &[&str])] = &[
    ("tools_spec", &[]),
    ("ik", &[]),
    ("sim", &[]),
    // Crates that compile the same sources with every extra.
    ("tests/extras", &[]),
    ("episodes", &["tandem-sim", "tandem-ik", "tandem-tools-spec"]),
    ("episodes/evaluation", &["tandem-episodes", "tandem-sim", "tandem-tools-spec"]),
    (
        "tests/bench",
        &["tandem-evaluation", "tandem-episodes", "tandem-sim", "tandem-ik", "tandem-tools-spec"],
    ),
    ("gateway/policies", &["tandem-episodes", "tandem-evaluation", "tandem-tools-spec"]),
    (
        "gateway",
        &["tandem-bench", "tandem-policies", "tandem-episodes", "tandem-evaluation", "tandem-tools-spec"],
    ),
    (
        "tests",
        &[
            "tandem",
            "tandem-policies",
            "tandem-episodes",
            "tandem-evaluation",
            "tandem-ik",
            "tandem-sim",
            "tandem-tools-spec",
        ],
    ),
];

/// Returns the folders of the crates that have their own source files.
pub fn members() -> impl Iterator<Item = &'static str> {
    ARROWS.iter().map(|(member, _)| *member).filter(|member| root().join(member).join("src").is_dir())
}

fn manifest(folder: &str) -> toml::Table {
    let path = root().join(folder).join("Cargo.toml");
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn crates_depend_along_the_arrows() {
    for (member, allowed) in ARROWS {
        let manifest = manifest(member);
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
    let manifest = manifest("");
    let listed = manifest["workspace"]["members"].as_array().into_iter().flatten();
    let mut listed: Vec<&str> = listed.filter_map(toml::Value::as_str).collect();
    let mut named: Vec<&str> = ARROWS.iter().map(|(member, _)| *member).collect();
    listed.sort_unstable();
    named.sort_unstable();
    assert_eq!(named, listed);
}

/// Returns the versions of every package in a lock file.
fn locked(path: &str) -> BTreeMap<String, BTreeSet<String>> {
    let text = fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    let lock: toml::Table = text.parse().unwrap_or_else(|error| panic!("{path}: {error}"));
    let mut versions = BTreeMap::<String, BTreeSet<String>>::new();
    for package in lock["package"].as_array().into_iter().flatten() {
        let entry = |name: &str| package[name].as_str().unwrap_or_default().to_owned();
        versions.entry(entry("name")).or_default().insert(entry("version"));
    }
    versions
}

/// The program and the wheel use the same versions of crates. The same seed with the same commands must lead
/// to the same state in both.
#[test]
fn the_wheel_is_made_of_the_same_versions() {
    let program = locked("Cargo.lock");
    let wheel = locked("gateway/python/Cargo.lock");
    let differs = wheel.iter().filter_map(|(name, versions)| {
        let known = program.get(name)?;
        (!versions.is_subset(known)).then(|| format!("{name}: {versions:?}, and {known:?} in Cargo.lock"))
    });
    let rule = "gateway/python/Cargo.lock has the versions of Cargo.lock; copy that and run `cargo metadata` in gateway/python";
    expect_none(&differs.collect::<Vec<_>>(), rule);
}
