//! The text format of Prometheus, version 0.0.4, and its histograms.

use std::{
    fmt::{Display, Write},
    time::Duration,
};

/// A page under construction.
#[derive(Debug, Default)]
pub struct MetricsPage {
    text: String,
}

impl MetricsPage {
    /// Media type of the page.
    pub const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

    /// Adds a gauge, a number that goes up and down.
    pub fn gauge(&mut self, name: &str, help: &str, value: impl Display) {
        self.head(name, help, "gauge");
        self.line(format_args!("{name} {value}"));
    }

    /// Adds a counter with a value for each label. A counter never decreases.
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

    /// Adds histograms of durations by label.
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

    /// Returns the whole page.
    pub fn text(self) -> String {
        self.text
    }

    fn head(&mut self, name: &str, help: &str, kind: &str) {
        self.line(format_args!("# HELP {name} {help}\n# TYPE {name} {kind}"));
    }

    fn line(&mut self, line: impl Display) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{line}");
    }
}

/// Upper bounds of the buckets in seconds. Calls without physics take less than a millisecond. Commands and
/// images take a few hundred milliseconds.
const BOUNDS_S: [f64; 12] = [0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0];

/// Durations, counted in buckets.
#[derive(Debug, Default)]
pub struct Histogram {
    /// Number of durations per bucket. The last bucket counts the durations above every bound.
    counts: [u64; BOUNDS_S.len() + 1],
    sum: Duration,
}

impl Histogram {
    /// Counts a duration.
    pub fn add(&mut self, took: Duration) {
        let bucket = BOUNDS_S.iter().position(|bound_s| took.as_secs_f64() <= *bound_s);
        self.counts[bucket.unwrap_or(BOUNDS_S.len())] += 1;
        self.sum += took;
    }

    /// Returns the number of durations up to each bound. The last number counts all durations.
    fn cumulative(&self) -> [u64; BOUNDS_S.len() + 1] {
        let mut sum = 0;
        self.counts.map(|count| {
            sum += count;
            sum
        })
    }

    /// Returns the sum of all durations.
    fn sum(&self) -> Duration {
        self.sum
    }
}
