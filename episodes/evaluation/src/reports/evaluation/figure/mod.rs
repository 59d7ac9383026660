//! Figures of a report: drawings in SVG, which the page contains and which files hold alone.

mod file;
pub mod rates;
pub mod times;

pub use file::{rates_file, times_file};

use tandem_episodes::html::escape;

/// Number of colours; more policies share them.
pub const SERIES: usize = 6;

/// A drawing of one task. Its shapes have the classes of the page's style.
pub struct Figure {
    pub title: String,
    /// Description for readers who cannot see it.
    pub label: String,
    pub width_px: f64,
    pub height_px: f64,
    pub shapes: String,
}

impl Figure {
    /// Renders a card of the page.
    pub fn card(&self) -> String {
        let Figure { title, label, width_px, height_px, shapes } = self;
        format!(
            r#"<section class="card"><h3>{}</h3><svg viewBox="0 0 {width_px} {height_px}" role="img" aria-label="{}">{shapes}</svg></section>"#,
            escape(title),
            escape(label),
        )
    }
}

/// Returns the class of a policy's colour.
pub fn colour_class(policy: usize) -> String {
    format!("c{}", policy % SERIES)
}
