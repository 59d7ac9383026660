//! Rows at a policy's rate, with the control steps that they span.

use tandem_episodes::{CONTROL_HZ, rows::between_rows};

use super::ActionRow;
use crate::map::Between;

/// A row, with the number of control steps in which robots move to its targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowSpan {
    pub row: usize,
    pub steps: u32,
}

/// Returns the spans of `rows` rows at `rate_hz`. Row i is reached at the time (i + 1) / `rate_hz`.
///
/// If several rows fall within one control step, the last one is used. If all rows together are too short for
/// a control step, they take one.
pub fn spans(rows: usize, rate_hz: f64) -> Vec<RowSpan> {
    let reached_at = |row: usize| ((row + 1) as f64 * CONTROL_HZ / rate_hz).round() as u32;
    let (mut spans, mut begins) = (Vec::with_capacity(rows), 0);
    for row in 0..rows {
        let is_last = row + 1 == rows;
        let ends = reached_at(row);
        if ends > begins && (is_last || reached_at(row + 1) > ends) {
            spans.push(RowSpan { row, steps: ends - begins });
            begins = ends;
        }
    }
    if spans.is_empty() && rows > 0 {
        spans.push(RowSpan { row: rows - 1, steps: 1 });
    }
    spans
}

/// Converts rows to rows of `send_joint_chunk`, one per control step, for a robot whose last commanded row
/// was `from_row`.
pub fn control_rows(
    rows: &[ActionRow],
    spans: &[RowSpan],
    from_row: &[f64],
    between: Between,
) -> Vec<Vec<f64>> {
    let mut before = from_row;
    let mut control_rows = Vec::new();
    for span in spans {
        let goal = &rows[span.row].row;
        for step in 1..=span.steps {
            control_rows.push(match between {
                Between::Hold => goal.clone(),
                Between::Interpolate => between_rows(before, goal, f64::from(step) / f64::from(span.steps)),
            });
        }
        before = goal;
    }
    control_rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::action::WristTarget;

    fn spanned(rows: usize, rate_hz: f64) -> Vec<(usize, u32)> {
        spans(rows, rate_hz).into_iter().map(|span| (span.row, span.steps)).collect()
    }

    #[test]
    fn rows_last_as_long_as_their_rate_says() {
        assert_eq!(spanned(3, 50.0), [(0, 1), (1, 1), (2, 1)]);
        assert_eq!(spanned(4, 15.0), [(0, 3), (1, 4), (2, 3), (3, 3)]);
        assert_eq!(spanned(2, 2.0), [(0, 25), (1, 25)]);
        // If two rows fall within one control step, the later one is used.
        assert_eq!(spanned(4, 100.0), [(1, 1), (3, 1)]);
        assert_eq!(spanned(2, 1000.0), [(1, 1)], "at least one step, so that time goes on");
        let total: u32 = spans(150, 15.0).iter().map(|span| span.steps).sum();
        assert_eq!(total, 500, "ten seconds");
    }

    #[test]
    fn rows_are_held_or_interpolated() {
        let row = |value: f64| ActionRow {
            row: vec![value; 35],
            wrists: [WristTarget::default(); 2],
            motor_row: Vec::new(),
        };
        let rows = [row(1.0), row(2.0)];
        let played = |between: Between, column: usize| -> Vec<f64> {
            let rows = control_rows(&rows, &spans(2, 25.0), &[0.0; 35], between);
            rows.iter().map(|row| row[column]).collect()
        };
        assert_eq!(played(Between::Interpolate, 0), [0.5, 1.0, 1.5, 2.0]);
        assert_eq!(played(Between::Hold, 0), [1.0, 1.0, 2.0, 2.0]);
        // Velocities are not interpolated, in contrast to positions such as the height.
        assert_eq!(played(Between::Interpolate, 31), [1.0, 1.0, 2.0, 2.0]);
        assert_eq!(played(Between::Interpolate, 34), [0.5, 1.0, 1.5, 2.0]);
    }
}
