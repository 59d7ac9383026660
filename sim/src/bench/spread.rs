//! A figure and how much it varies.

use serde::Serialize;

/// Median and quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    pub median: f64,
    pub quartiles: [f64; 2],
}

impl Spread {
    /// Of at least one number; it puts them in order.
    pub(super) fn of(values: &mut [f64]) -> Spread {
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
        Spread { median: at(0.5), quartiles: [at(0.25), at(0.75)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_leave_a_quarter_on_each_side() {
        let mut values = [5.0, 1.0, 4.0, 2.0, 3.0];
        assert_eq!(Spread::of(&mut values), Spread { median: 3.0, quartiles: [2.0, 4.0] });
        assert_eq!(Spread::of(&mut [7.0]), Spread { median: 7.0, quartiles: [7.0, 7.0] });
    }
}
