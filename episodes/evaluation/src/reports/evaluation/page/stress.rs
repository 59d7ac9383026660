//! Plot of rates under stress. For each axis, it has a bar with an interval for each level. A line shows the
//! rate without stress.

use tandem_episodes::{html::escape, stress::StressAxis};

use crate::reports::evaluation::rate::percent;
use crate::reports::evaluation::stress::{StressReport, StressRow};

const WIDTH_PX: f64 = 640.0;
/// Horizontal position of 0 %, 8 px to the right of the axes' names; `RIGHT_PX` is the position of 100 %.
const LEFT_PX: f64 = 78.0;
const RIGHT_PX: f64 = 560.0;
const TOP_PX: f64 = 18.0;
const LANE_PX: f64 = 12.0;
const GAP_PX: f64 = 8.0;
const AXIS_PX: f64 = 20.0;

/// Renders the section of the page about stress; empty if there is no such report.
pub fn html(reports: &[StressReport]) -> String {
    let cards: String = reports.iter().map(card).collect();
    match cards.is_empty() {
        true => String::new(),
        false => format!(
            r#"<h2>Under stress</h2><p class="soft">Bars: whole tasks of all that were played, level 1 above, then 2 and 3, with exact intervals of 95 %. The dashed line is the rate without stress.</p>{cards}"#
        ),
    }
}

fn card(report: &StressReport) -> String {
    let (mut drawn, mut y_px) = (String::new(), TOP_PX);
    for axis in StressAxis::ALL {
        let rows: Vec<&StressRow> = report.overall().filter(|row| row.axis == axis).collect();
        if rows.is_empty() {
            continue;
        }
        let middle_px = y_px + 0.5 * LANE_PX * rows.len() as f64;
        drawn += &format!(
            r#"<text class="phase" x="{:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
            LEFT_PX - 8.0,
            middle_px + 4.0,
            axis.name()
        );
        for row in rows {
            drawn += &bar(row, y_px);
            y_px += LANE_PX;
        }
        y_px += GAP_PX;
    }
    let plain = report.plain.map_or(String::new(), |plain| {
        let x_px = x_px(plain.share);
        format!(
            r#"<line x1="{x_px:.1}" x2="{x_px:.1}" y1="{:.1}" y2="{y_px:.1}" stroke="currentColor" stroke-dasharray="4 3"><title>without stress: {} %, {}</title></line>"#,
            TOP_PX - 6.0,
            plain.text(),
            plain.fraction()
        )
    });
    let most = report.hurts_most.as_ref().map_or(String::new(), |loss| {
        format!(
            r#"<p class="soft">What hurts most is {}: {} points in the mean of its levels.</p>"#,
            loss.axis.name(),
            percent(-loss.difference_share)
        )
    });
    let (title, height_px) = (escape(&report.policy), y_px + AXIS_PX);
    format!(
        r#"<section class="card"><h3>{title}</h3>{most}<svg viewBox="0 0 {WIDTH_PX} {height_px}" role="img" aria-label="Rates of {title} under stress">{}<g style="--c: var(--s0)">{drawn}</g>{plain}</svg></section>"#,
        axis_lines(y_px)
    )
}

/// Renders a bar from 0 to the rate, with its interval. Bars of lower levels are fainter.
fn bar(row: &StressRow, y_px: f64) -> String {
    let label = format!(
        "{}, level {}: {} %, {}{}",
        row.axis.name(),
        row.level,
        row.rate.text(),
        row.rate.fraction(),
        row.paired.as_ref().map(|paired| format!(", difference {}", paired.text())).unwrap_or_default()
    );
    let middle_px = y_px + 0.5 * LANE_PX;
    let [from_px, to_px] = row.rate.interval_share.map(x_px);
    let opacity = 0.25 + 0.25 * f64::from(row.level);
    format!(
        r#"<g><title>{}</title><rect x="{LEFT_PX}" y="{:.1}" width="{:.1}" height="{:.1}" fill="var(--c)" opacity="{opacity:.2}"/><line class="interval" x1="{from_px:.1}" x2="{to_px:.1}" y1="{middle_px:.1}" y2="{middle_px:.1}"/><text class="count" x="{:.1}" y="{:.1}">{}</text></g>"#,
        escape(&label),
        y_px + 1.0,
        x_px(row.rate.share) - LEFT_PX,
        LANE_PX - 2.0,
        WIDTH_PX - 4.0,
        middle_px + 3.8,
        row.rate.fraction(),
    )
}

fn x_px(share: f64) -> f64 {
    LEFT_PX + share * (RIGHT_PX - LEFT_PX)
}

/// Renders lines and numbers from 0 to 100 %, down to `bottom_px`.
fn axis_lines(bottom_px: f64) -> String {
    let tick = |percent: u32| {
        let x_px = x_px(f64::from(percent) / 100.0);
        let unit = if percent == 100 { " %" } else { "" };
        format!(
            r#"<line class="grid" x1="{x_px:.1}" x2="{x_px:.1}" y1="{TOP_PX}" y2="{bottom_px:.1}"/><text class="tick" x="{x_px:.1}" y="{:.1}" text-anchor="middle">{percent}{unit}</text>"#,
            bottom_px + 13.0
        )
    };
    [0, 25, 50, 75, 100].map(tick).concat()
}
