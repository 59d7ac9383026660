//! The files of the repository, as the invariants read them.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Folders that hold what was built or recorded, not what was written.
const NOT_OURS: [&str; 3] = ["target", "runs", "node_modules"];

/// One file.
pub struct Source {
    /// From the root of the repository.
    pub path: PathBuf,
    pub text: String,
}

impl Source {
    /// The file as Rust, with the lines at which everything stands.
    pub fn parse(&self) -> syn::File {
        syn::parse_file(&self.text).unwrap_or_else(|error| panic!("{}: {error}", self.path.display()))
    }
}

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace").into()
}

/// Every file with one of the `extensions`.
pub fn everywhere(extensions: &[&str]) -> Vec<Source> {
    let found = below("", extensions);
    assert!(found.len() > 20, "only {} files found below {}", found.len(), root().display());
    found
}

/// Every file of a folder of the repository with one of the `extensions`.
pub fn below(folder: &str, extensions: &[&str]) -> Vec<Source> {
    let mut paths = Vec::new();
    collect(&root().join(folder), extensions, &mut paths);
    paths.sort();
    paths.into_iter().map(|path| read(&path)).collect()
}

fn read(path: &Path) -> Source {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Source { path: path.strip_prefix(root()).expect("below the root").into(), text }
}

fn collect(folder: &Path, extensions: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("an entry of a folder").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() {
            if !name.starts_with('.') && !NOT_OURS.contains(&name.as_str()) {
                collect(&path, extensions, found);
            }
        } else if path.extension().is_some_and(|extension| extensions.iter().any(|ours| extension == *ours)) {
            found.push(path);
        }
    }
}

/// Fails with `rule` and the list of what breaks it.
#[track_caller]
pub fn expect_none(wrong: &[String], rule: &str) {
    assert!(wrong.is_empty(), "{rule}:\n  {}", wrong.join("\n  "));
}
