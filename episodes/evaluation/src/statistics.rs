//! Uncertainty of episode counts: exact and score intervals of rates and of means of rates, and intervals of
//! the difference between two policies on the same episodes.

use statrs::distribution::{Beta, Binomial, ContinuousCDF, DiscreteCDF};

/// Probability on each side of a 95 % interval.
const TAIL: f64 = 0.025;
/// Quantile of the normal distribution that is exceeded with the probability `TAIL`.
const Z: f64 = 1.959_963_984_540_054;

/// Number of successes among trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Count {
    pub successes: usize,
    pub trials: usize,
}

impl Count {
    /// Returns the rate of success; `None` without trials.
    pub fn share(self) -> Option<f64> {
        (self.trials > 0).then(|| self.successes as f64 / self.trials as f64)
    }
}

/// Returns the exact 95 % interval of a rate (Clopper and Pearson, 1934). Its limits are quantiles of beta
/// distributions.
pub fn clopper_pearson(count: Count) -> [f64; 2] {
    let (k, n) = (count.successes as f64, count.trials as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    let low = if count.successes == 0 { 0.0 } else { quantile(k, n - k + 1.0, TAIL) };
    let high = if count.successes == count.trials { 1.0 } else { quantile(k + 1.0, n - k, 1.0 - TAIL) };
    [low, high]
}

/// Returns the 95 % score interval of a rate (Wilson, 1927).
pub fn wilson(count: Count) -> [f64; 2] {
    let (k, n) = (count.successes as f64, count.trials as f64);
    let share = k / n;
    let middle = share + Z * Z / (2.0 * n);
    let reach = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    [-1.0, 1.0].map(|sign| ((middle + sign * reach) / (1.0 + Z * Z / n)).clamp(0.0, 1.0))
}

/// Returns the mean of rates with equal weights, and its interval (Zou and Donner, 2008). The distances of
/// the exact limits from their rates are added in quadrature. Returns `None` without trials.
pub fn mean_share(counts: &[Count]) -> Option<(f64, [f64; 2])> {
    let known: Vec<(f64, [f64; 2])> =
        counts.iter().filter_map(|count| Some((count.share()?, clopper_pearson(*count)))).collect();
    let rates = known.len() as f64;
    let mean = known.iter().map(|(share, _)| share).sum::<f64>() / rates;
    let reach = |limit: usize| {
        known.iter().map(|(share, interval)| (share - interval[limit]).powi(2)).sum::<f64>().sqrt() / rates
    };
    (!known.is_empty()).then(|| (mean, [mean - reach(0), mean + reach(1)]))
}

/// Counts of paired outcomes of two policies on the same episodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Pairs {
    pub both: usize,
    pub first_only: usize,
    pub second_only: usize,
    pub neither: usize,
}

impl Pairs {
    pub fn total(self) -> usize {
        self.both + self.first_only + self.second_only + self.neither
    }

    fn first(self) -> Count {
        Count { successes: self.both + self.first_only, trials: self.total() }
    }

    fn second(self) -> Count {
        Count { successes: self.both + self.second_only, trials: self.total() }
    }

    /// Returns the rate of the second policy minus that of the first; `None` without pairs.
    pub fn difference_share(self) -> Option<f64> {
        Some(self.second().share()? - self.first().share()?)
    }
}

/// Returns the two-sided exact p-value of equal success (McNemar, 1947). It is the probability of a split at
/// least as uneven among the episodes in which only one policy succeeds.
pub fn mcnemar(pairs: Pairs) -> f64 {
    let (fewer, discordant) = (pairs.first_only.min(pairs.second_only), pairs.first_only + pairs.second_only);
    let tail = Binomial::new(0.5, discordant as u64).map_or(1.0, |split| split.cdf(fewer as u64));
    (2.0 * tail).min(1.0)
}

/// Returns the 95 % interval of [`Pairs::difference_share`] (Newcombe, 1998, the tenth of its methods).
/// It combines the score limits of both rates and their correlation.
/// For p1, p2 with limits [l1, u1], [l2, u2] and correlation phi,
///   lower = p2 - p1 - sqrt((p2 - l2)^2 - 2 phi (p2 - l2) (u1 - p1) + (u1 - p1)^2),
/// and the upper limit adds the root with the other limits.
pub fn newcombe(pairs: Pairs) -> Option<[f64; 2]> {
    let (first, second) = (pairs.first(), pairs.second());
    let (p1, p2) = (first.share()?, second.share()?);
    let ([l1, u1], [l2, u2]) = (wilson(first), wilson(second));
    let phi = correlation(pairs);
    let reach = |a: f64, b: f64| (a * a - 2.0 * phi * a * b + b * b).max(0.0).sqrt();
    let difference = p2 - p1;
    Some([difference - reach(p2 - l2, u1 - p1), difference + reach(u2 - p2, p1 - l1)])
}

/// Returns the correlation of two binary outcomes, corrected for continuity if it is positive.
fn correlation(pairs: Pairs) -> f64 {
    let [a, b, c, d] = [pairs.both, pairs.first_only, pairs.second_only, pairs.neither].map(|n| n as f64);
    let margins = (a + b) * (c + d) * (a + c) * (b + d);
    let (excess, half) = (a * d - b * c, (a + b + c + d) / 2.0);
    let corrected = if excess > 0.0 { (excess - half).max(0.0) } else { excess };
    if margins > 0.0 { corrected / margins.sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests;
