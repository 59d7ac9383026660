//! The pages: README, what else lies beside it, and the book; their blocks of code and their prose.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Folder of the book's pages, from the root of the repository.
pub const BOOK: &str = "docs/src";

/// The book's table of contents.
pub const CONTENTS: &str = "SUMMARY.md";

/// One page.
pub struct Page {
    /// From the root of the repository.
    pub path: PathBuf,
    pub text: String,
}

/// A fenced block of code.
pub struct Block {
    /// The language, as `sh`.
    pub language: String,
    /// What the fence says besides, as `run`; empty where it says nothing.
    pub purpose: String,
    pub text: String,
    /// Line of the fence, from 1.
    pub line: usize,
}

/// The root of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace")
}

/// README and the pages of the book without its table of contents.
pub fn pages() -> Vec<Page> {
    let book = paths_below(&root().join(BOOK));
    let paths = book.into_iter().filter(|path| !path.ends_with(CONTENTS));
    let pages: Vec<Page> = [root().join("README.md")].into_iter().chain(paths).map(read).collect();
    assert!(pages.len() > 20, "only {} pages found", pages.len());
    pages
}

/// The pages, and what else lies at the root for people to read.
pub fn all_documents() -> Vec<Page> {
    let mut documents = pages();
    documents.push(page(&format!("{BOOK}/{CONTENTS}")));
    for name in ["ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"] {
        documents.extend(Some(root().join(name)).filter(|path| path.exists()).map(read));
    }
    documents
}

/// One page by its path from the root of the repository.
pub fn page(path: &str) -> Page {
    read(root().join(path))
}

fn read(path: PathBuf) -> Page {
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Page { path: path.strip_prefix(root()).expect("below the root").into(), text }
}

/// Every page of a folder and of the folders in it, in order.
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
    /// Where something stands, for messages.
    pub fn at(&self, line: usize) -> String {
        format!("{}:{line}", self.path.display())
    }

    /// The fenced blocks of code, in order.
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

    /// The lines outside of blocks of code, with their numbers from 1.
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

    /// The text without blocks of code and without what stands in backticks, by lines.
    pub fn prose(&self) -> Vec<(usize, String)> {
        let outside = |line: &str| line.split('`').step_by(2).collect::<Vec<_>>().join("`");
        self.lines().into_iter().map(|(number, line)| (number, outside(line))).collect()
    }

    /// What stands in backticks, with the numbers of the lines.
    pub fn in_backticks(&self) -> Vec<(usize, String)> {
        let inside = |(number, line): (usize, &'_ str)| {
            let words: Vec<_> =
                line.split('`').skip(1).step_by(2).map(|words| (number, words.to_owned())).collect();
            words
        };
        self.lines().into_iter().flat_map(inside).collect()
    }
}
