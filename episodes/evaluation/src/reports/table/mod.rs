//! Tables of reports: rows of texts, with one writer for each format.

mod html;
mod markdown;
mod tex;

use std::collections::BTreeMap;

pub use html::{html, marked};
pub use markdown::markdown;
pub use tex::tex;

/// A table with texts as cells.
pub struct Table {
    pub title: String,
    /// Explanation of the table. Parts in backticks are code.
    pub note: String,
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
    /// Index of the first column that contains figures.
    pub figures_from: usize,
    /// Link targets of cells, by row and column. A target is a URL or a path relative to the report.
    pub links: BTreeMap<(usize, usize), String>,
}

/// Text of a cell without a value.
pub const NONE: &str = "-";

impl Table {
    pub fn new(title: impl Into<String>, note: &str, head: &[&str], figures_from: usize) -> Table {
        Table {
            title: title.into(),
            note: note.into(),
            head: head.iter().map(|text| (*text).into()).collect(),
            rows: Vec::new(),
            figures_from,
            links: BTreeMap::new(),
        }
    }
}
