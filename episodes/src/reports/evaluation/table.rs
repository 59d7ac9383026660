//! What a table of a report is, and how its figures are written.

use super::rate::percent;

/// Words in rows and columns.
pub struct Table {
    pub title: String,
    /// What has to be known to read it.
    pub note: String,
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
    /// Columns from this one on hold figures.
    pub figures_from: usize,
    /// Where the last cell of each row leads, in a table whose rows lead somewhere.
    pub links: Vec<String>,
}

/// What there is nothing to say of.
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

/// A share in percent, with its sign.
pub fn signed(share: f64) -> String {
    let text = percent(share);
    if share > 0.0 && text != "0" { format!("+{text}") } else { text }
}

/// A p value.
pub fn p_text(p_value: f64) -> String {
    if p_value < 0.0001 { "< 0.0001".into() } else { format!("{p_value:.4}") }
}
