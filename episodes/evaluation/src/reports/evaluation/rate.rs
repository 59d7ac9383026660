//! Rates and means of rates, with their intervals, and their formatting.

use serde::Serialize;

use crate::statistics::{Count, clopper_pearson, mean_share};

/// Success rate over at least one trial.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    pub successes: usize,
    pub trials: usize,
    pub share: f64,
    /// Exact 95 % interval.
    pub interval_share: [f64; 2],
}

impl Rate {
    /// Returns the rate; `None` without trials.
    pub fn of(count: Count) -> Option<Rate> {
        let Count { successes, trials } = count;
        Some(Rate { successes, trials, share: count.share()?, interval_share: clopper_pearson(count) })
    }

    pub fn count(self) -> Count {
        Count { successes: self.successes, trials: self.trials }
    }

    /// Formats the rate and its interval in percent, for example `97.5 [93.2, 99.5]`.
    pub fn text(self) -> String {
        with_interval(self.share, self.interval_share)
    }

    /// Formats the counts, for example `39/40`.
    pub fn fraction(self) -> String {
        format!("{}/{}", self.successes, self.trials)
    }
}

/// Mean of rates with equal weights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeanRate {
    pub counts: Vec<Count>,
    pub mean_share: f64,
    /// 95 % interval.
    pub interval_share: [f64; 2],
}

impl MeanRate {
    /// Returns the mean of the rates that have trials; `None` if no rate has trials.
    pub fn of(counts: impl Iterator<Item = Count>) -> Option<MeanRate> {
        let counts: Vec<Count> = counts.filter(|count| count.trials > 0).collect();
        let (mean_share, interval_share) = mean_share(&counts)?;
        Some(MeanRate { counts, mean_share, interval_share })
    }

    /// Formats the mean and its interval in percent; see [`Rate::text`].
    pub fn text(&self) -> String {
        with_interval(self.mean_share, self.interval_share)
    }
}

fn with_interval(share: f64, [low_share, high_share]: [f64; 2]) -> String {
    format!("{} [{}, {}]", percent(share), percent(low_share), percent(high_share))
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

/// Formats a share in percent with one decimal, which is omitted if it is zero.
pub fn percent(share: f64) -> String {
    let text = format!("{:.1}", 100.0 * share);
    // A value that rounds to zero has no sign.
    let text = if text == "-0.0" { "0.0" } else { text.as_str() };
    text.strip_suffix(".0").unwrap_or(text).to_owned()
}
