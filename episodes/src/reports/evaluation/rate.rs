//! Rates and means of rates, with what they leave open, and how they are written.

use serde::Serialize;

use crate::statistics::{Count, clopper_pearson, mean_share};

/// Successes of trials, of which there is at least one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    pub successes: usize,
    pub trials: usize,
    pub share: f64,
    /// Exact, 95 %.
    pub interval_share: [f64; 2],
}

impl Rate {
    /// `None` without trials.
    pub fn of(count: Count) -> Option<Rate> {
        let Count { successes, trials } = count;
        Some(Rate { successes, trials, share: count.share()?, interval_share: clopper_pearson(count) })
    }

    pub fn count(self) -> Count {
        Count { successes: self.successes, trials: self.trials }
    }

    /// The rate and its interval in percent, as `97.5 [93.2, 99.5]`.
    pub fn text(self) -> String {
        with_interval(self.share, self.interval_share)
    }

    /// The counts, as `39/40`.
    pub fn fraction(self) -> String {
        format!("{}/{}", self.successes, self.trials)
    }
}

/// A mean of rates that each count the same.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeanRate {
    pub counts: Vec<Count>,
    pub mean_share: f64,
    /// 95 %.
    pub interval_share: [f64; 2],
}

impl MeanRate {
    /// The mean of those rates that have trials; `None` where none has.
    pub fn of(counts: impl Iterator<Item = Count>) -> Option<MeanRate> {
        let counts: Vec<Count> = counts.filter(|count| count.trials > 0).collect();
        let (mean_share, interval_share) = mean_share(&counts)?;
        Some(MeanRate { counts, mean_share, interval_share })
    }

    /// The mean and its interval in percent; see [`Rate::text`].
    pub fn text(&self) -> String {
        with_interval(self.mean_share, self.interval_share)
    }
}

fn with_interval(share: f64, [low_share, high_share]: [f64; 2]) -> String {
    format!("{} [{}, {}]", percent(share), percent(low_share), percent(high_share))
}

/// A share in percent with one decimal, which is left out where it is zero.
pub fn percent(share: f64) -> String {
    let text = format!("{:.1}", 100.0 * share);
    // What rounds to zero has no sign.
    let text = if text == "-0.0" { "0.0" } else { text.as_str() };
    text.strip_suffix(".0").unwrap_or(text).to_owned()
}
