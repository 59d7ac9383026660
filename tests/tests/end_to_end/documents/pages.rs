//! Pages: README, the other documents in its folder, and the book, with their code blocks and prose.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Folder of the book's pages, relative to the root of the repository.
pub const BOOK: &str = "docs/src";

/// The book's table of contents.
pub const CONTENTS: &str = "SUMMARY.md";

/// A page of the documents.
pub struct Page {
    /// Path relative to the root of the repository.
    pub path: PathBuf,
    pub text: String,
}

/// A fenced block of code.
pub struct Block {
    /// Language, for example `sh`.
    pub language: String,
    /// Rest of the fence, for example `run`; empty if there is none.
    pub purpose: String,
    pub text: String,
    /// Line of the fence, counted from 1.
    pub line: usize,
}

/// Returns the root of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace")
}

/// Returns README and the pages of the book, without its table of contents.
pub fn pages() -> Vec<Page> {
    let book = paths_below(&root().join(BOOK));
    let paths = book.into_iter().filter(|path| !path.ends_with(CONTENTS));
    let pages: Vec<Page> = [root().join("README.md")].into_iter().chain(paths).map(read).collect();
    assert!(pages.len() > 20, "only {} pages found", pages.len());
    pages
}

/// Returns the pages, the table of contents, and the other documents at the root.
pub fn all_documents() -> Vec<Page> {
    let mut documents = pages();
    documents.push(page(&format!("{BOOK}/{CONTENTS}")));
    for name in ["ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"] {
        documents.extend(Some(root().join(name)).filter(|path| path.exists()).map(read));
    }
    documents
}

/// Returns a page by its path relative to the root of the repository.
pub fn page(path: &str) -> Page {
    read(root().join(path))
}

fn read(path: PathBuf) -> Page {
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Page { path: path.strip_prefix(root()).expect("below the root").into(), text }
}

/// Returns every page in a folder and its subfolders, in order.
pub fn paths_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("an entry of a folder").path();
        if path.is_dir() {
            found.extend(paths_below(&path));
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
    found.sort();
    found
}

impl Page {
    /// Returns the location of a line, for messages.
    pub fn at(&self, line: usize) -> String {
        format!("{}:{line}", self.path.display())
    }

    /// Returns the fenced code blocks, in order.
    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut open = false;
        for (index, line) in self.text.lines().enumerate() {
            match (line.trim_start().strip_prefix("```"), open) {
                (Some(fence), false) => {
                    let (language, purpose) = fence.trim().split_once(',').unwrap_or((fence.trim(), ""));
                    let [language, purpose] = [language, purpose].map(str::to_owned);
                    blocks.push(Block { language, purpose, text: String::new(), line: index + 1 });
                    open = true;
                }
                (Some(_), true) => open = false,
                (None, true) => {
                    let block = blocks.last_mut().expect("an open block");
                    block.text.push_str(line);
                    block.text.push('\n');
                }
                (None, false) => {}
            }
        }
        assert!(!open, "{}: a block of code is not closed", self.path.display());
        blocks
    }

    /// Returns the lines outside code blocks, numbered from 1.
    fn lines(&self) -> Vec<(usize, &str)> {
        let mut fenced = false;
        let mut lines = Vec::new();
        for (index, line) in self.text.lines().enumerate() {
            if line.trim_start().starts_with("```") {
                fenced = !fenced;
            } else if !fenced {
                lines.push((index + 1, line));
            }
        }
        lines
    }

    /// Returns the text outside code blocks and backticks, by line.
    pub fn prose(&self) -> Vec<(usize, String)> {
        let outside = |line: &str| line.split('`').step_by(2).collect::<Vec<_>>().join("`");
        self.lines().into_iter().map(|(number, line)| (number, outside(line))).collect()
    }

    /// Returns the texts in backticks with their line numbers.
    pub fn in_backticks(&self) -> Vec<(usize, String)> {
        let inside = |(number, line): (usize, &'_ str)| {
            let words: Vec<_> =
                line.split('`').skip(1).step_by(2).map(|words| (number, words.to_owned())).collect();
            words
        };
        self.lines().into_iter().flat_map(inside).collect()
    }
}
