//! Figures of a report: SVG drawings that the page contains and that are also separate files.

mod file;
pub mod rates;
pub mod times;

pub use file::{rates_file, times_file};

use tandem_episodes::html::escape;

/// Number of distinct colours. If there are more policies, several share a colour.
pub const SERIES: usize = 6;

/// A drawing for one task. Its shapes use the classes of the page's style.
pub struct Figure {
    pub title: String,
    /// Text description for readers who cannot see the figure.
    pub label: String,
    pub width_px: f64,
    pub height_px: f64,
    pub shapes: String,
}

impl Figure {
    /// Renders the figure as a card of the page.
    pub fn card(&self) -> String {
        let Figure { title, label, width_px, height_px, shapes } = self;
        format!(
            r#"<section class="card"><h3>{}</h3><svg viewBox="0 0 {width_px} {height_px}" role="img" aria-label="{}">{shapes}</svg></section>"#,
            escape(title),
            escape(label),
        )
    }
}

/// Returns the CSS class of a policy's colour.
pub fn colour_class(policy: usize) -> String {
    format!("c{}", policy % SERIES)
}
