//! Source files of the repository, for the tests of invariants.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Skipped folders, which have build products and recordings.
const NOT_OURS: [&str; 5] = ["target", "runs", "book", "node_modules", "__pycache__"];

/// A file of the repository.
pub struct Source {
    /// Path relative to the root of the repository.
    pub path: PathBuf,
    pub text: String,
}

impl Source {
    /// Parses the file as Rust, with line numbers.
    pub fn parse(&self) -> syn::File {
        syn::parse_file(&self.text).unwrap_or_else(|error| panic!("{}: {error}", self.path.display()))
    }
}

/// Returns the root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace").into()
}

/// Returns every file with one of the `extensions`.
pub fn everywhere(extensions: &[&str]) -> Vec<Source> {
    let found = below("", extensions);
    assert!(found.len() > 20, "only {} files found below {}", found.len(), root().display());
    found
}

/// Returns every file in a folder of the repository with one of the `extensions`.
pub fn below(folder: &str, extensions: &[&str]) -> Vec<Source> {
    let ours =
        |path: &PathBuf| path.extension().is_some_and(|own| extensions.iter().any(|ours| own == *ours));
    files(folder).into_iter().filter(ours).map(read).collect()
}

/// Returns the paths of all files in a folder, relative to the root of the repository. Hidden files are
/// left out.
pub fn files(folder: &str) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    collect(&root().join(folder), &mut paths);
    paths.sort();
    paths.iter().map(|path| path.strip_prefix(root()).expect("below the root").into()).collect()
}

fn read(path: PathBuf) -> Source {
    let text = fs::read_to_string(root().join(&path));
    Source { text: text.unwrap_or_else(|error| panic!("{}: {error}", path.display())), path }
}

fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("an entry of a folder").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with('.') || NOT_OURS.contains(&name.as_str()) {
            continue;
        }
        if path.is_dir() {
            collect(&path, found);
        } else {
            found.push(path);
        }
    }
}

/// Fails with `rule` and the list of violations.
#[track_caller]
pub fn expect_none(wrong: &[String], rule: &str) {
    assert!(wrong.is_empty(), "{rule}:\n  {}", wrong.join("\n  "));
}
