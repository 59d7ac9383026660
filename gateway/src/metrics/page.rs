//! The text format of Prometheus, version 0.0.4.

use std::fmt::{Display, Write};

use super::histogram::{BOUNDS_S, Histogram};

/// A page under way.
#[derive(Debug, Default)]
pub struct Page {
    text: String,
}

impl Page {
    /// The media type.
    pub const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

    /// A number that goes up and down.
    pub fn gauge(&mut self, name: &str, help: &str, value: impl Display) {
        self.head(name, help, "gauge");
        self.line(format_args!("{name} {value}"));
    }

    /// Numbers that only grow, by label.
    pub fn counter<L: Display, V: Display>(
        &mut self,
        name: &str,
        help: &str,
        values: impl IntoIterator<Item = (L, V)>,
    ) {
        self.head(name, help, "counter");
        for (label, value) in values {
            self.line(format_args!("{name}{label} {value}"));
        }
    }

    /// Times, by label.
    pub fn histograms<'a>(
        &mut self,
        name: &str,
        help: &str,
        values: impl IntoIterator<Item = (String, &'a Histogram)>,
    ) {
        self.head(name, help, "histogram");
        let bounds = || BOUNDS_S.map(|bound_s| bound_s.to_string()).into_iter().chain(["+Inf".into()]);
        for (label, histogram) in values {
            let counts = histogram.cumulative();
            for (bound, count) in bounds().zip(counts) {
                self.line(format_args!("{name}_bucket{{{label},le=\"{bound}\"}} {count}"));
            }
            self.line(format_args!("{name}_sum{{{label}}} {}", histogram.sum().as_secs_f64()));
            self.line(format_args!("{name}_count{{{label}}} {}", counts[BOUNDS_S.len()]));
        }
    }

    /// What was written.
    pub fn text(self) -> String {
        self.text
    }

    fn head(&mut self, name: &str, help: &str, kind: &str) {
        self.line(format_args!("# HELP {name} {help}\n# TYPE {name} {kind}"));
    }

    fn line(&mut self, line: impl Display) {
        // Writing to a text does not fail.
        let _ = writeln!(self.text, "{line}");
    }
}
