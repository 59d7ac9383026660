//! Tables of a report, and the formatting of their figures.

use super::rate::percent;

/// A table of texts.
pub struct Table {
    pub title: String,
    /// Explanation of the table.
    pub note: String,
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
    /// Index of the first column of figures.
    pub figures_from: usize,
    /// Link targets of the last cell of each row; empty for a table without links.
    pub links: Vec<String>,
}

/// Text of a cell without a value.
pub const NONE: &str = "-";

impl Table {
    pub fn new(title: impl Into<String>, note: &str, head: &[&str], figures_from: usize) -> Table {
        let head = head.iter().map(|text| text.to_string()).collect();
        Table {
            title: title.into(),
            note: note.into(),
            head,
            rows: Vec::new(),
            figures_from,
            links: Vec::new(),
        }
    }
}

/// Formats a share in percent, with its sign.
pub fn signed(share: f64) -> String {
    let text = percent(share);
    if share > 0.0 && text != "0" { format!("+{text}") } else { text }
}

/// Formats a p value.
pub fn p_text(p_value: f64) -> String {
    if p_value < 0.0001 { "< 0.0001".into() } else { format!("{p_value:.4}") }
}
