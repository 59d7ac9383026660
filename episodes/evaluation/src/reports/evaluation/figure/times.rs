//! Figure of the times at which one task's phases were reached. Each curve shows, for a phase and a policy,
//! the share of episodes that have reached the phase by then.

use tandem_episodes::html::escape;

use super::{Figure, colour_class};
use crate::reports::evaluation::policy::{PhaseReport, PolicyReport};
use crate::reports::evaluation::rate::percent;

const WIDTH_PX: f64 = 360.0;
/// Horizontal positions of the first and the last time, and vertical positions of 100 % and 0 %.
const LEFT_PX: f64 = 40.0;
const RIGHT_PX: f64 = 350.0;
const TOP_PX: f64 = 10.0;
const BOTTOM_PX: f64 = 170.0;
const HEIGHT_PX: f64 = 206.0;

/// Number of distinct line styles. If there are more phases, several share a style.
pub const LINES: usize = 4;
/// Maximum number of intervals on the time axis.
const MAX_INTERVALS: f64 = 6.0;
/// Possible distances between the ticks of that axis, in seconds.
const STEPS_S: [f64; 11] = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// Draws the curves of one task; `None` if no episode has reached any of its phases.
pub fn figure(task: &str, policies: &[PolicyReport]) -> Option<Figure> {
    let of_task = |policy: &PolicyReport| policy.tasks.iter().position(|of| of.task == task);
    let played = policies.iter().enumerate().filter_map(|(index, policy)| {
        Some((index, policy.name.as_str(), policy.tasks[of_task(policy)?].phases.as_slice()))
    });
    let played: Vec<(usize, &str, &[PhaseReport])> = played.collect();
    let times_s =
        played.iter().flat_map(|(.., phases)| *phases).flat_map(|phase| phase.reached_s.iter().copied());
    let last_s = times_s.max_by(f64::total_cmp)?;
    let step_s =
        STEPS_S.into_iter().find(|step_s| last_s / step_s <= MAX_INTERVALS).unwrap_or(last_s / MAX_INTERVALS);
    let end_s = step_s * (last_s / step_s).ceil();
    let mut shapes = axes(end_s, step_s);
    for (index, policy, phases) in &played {
        shapes += &format!(r#"<g class="{}">"#, colour_class(*index));
        shapes.extend(phases.iter().enumerate().map(|(number, phase)| curve(policy, number, phase, end_s)));
        shapes += "</g>";
    }
    let (title, label) = (task.to_owned(), format!("Times at which the phases of {task} were reached"));
    Some(Figure { title, label, width_px: WIDTH_PX, height_px: HEIGHT_PX, shapes })
}

/// Renders the curve of one phase. It steps up at each time at which an episode reached the phase.
fn curve(policy: &str, number: usize, phase: &PhaseReport, end_s: f64) -> String {
    let Some(rate) = phase.cumulative else { return String::new() };
    let mut path = format!("M{LEFT_PX} {BOTTOM_PX}");
    for (index, time_s) in phase.reached_s.iter().enumerate() {
        let share = (index + 1) as f64 / rate.trials as f64;
        path += &format!("H{:.1}V{:.1}", x_px(*time_s, end_s), y_px(share));
    }
    path += &format!("H{RIGHT_PX}");
    let median = phase.reached_s.get(phase.reached_s.len() / 2);
    let median = median.map_or(String::new(), |median_s| format!(", half of them by {median_s:.1} s"));
    let label = format!(
        "{policy}, {} {}: {} of {}{median}",
        phase.number,
        phase.id,
        phase.reached_s.len(),
        rate.trials
    );
    format!(r#"<path class="curve d{}" d="{path}"><title>{}</title></path>"#, number % LINES, escape(&label))
}

fn x_px(time_s: f64, end_s: f64) -> f64 {
    LEFT_PX + time_s / end_s * (RIGHT_PX - LEFT_PX)
}

fn y_px(share: f64) -> f64 {
    BOTTOM_PX - share * (BOTTOM_PX - TOP_PX)
}

/// Renders lines and numbers of both axes.
fn axes(end_s: f64, step_s: f64) -> String {
    let mut drawn = String::new();
    for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let y_px = y_px(share);
        drawn += &format!(
            r#"<line class="grid" x1="{LEFT_PX}" x2="{RIGHT_PX}" y1="{y_px:.1}" y2="{y_px:.1}"/><text class="tick" x="{:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
            LEFT_PX - 6.0,
            y_px + 4.0,
            percent(share),
        );
    }
    for mark in 0..=(end_s / step_s).round() as usize {
        let time_s = mark as f64 * step_s;
        drawn += &format!(
            r#"<text class="tick" x="{:.1}" y="{:.1}" text-anchor="middle">{time_s}</text>"#,
            x_px(time_s, end_s),
            BOTTOM_PX + 16.0,
        );
    }
    let middle_px = (LEFT_PX + RIGHT_PX) / 2.0;
    drawn
        + &format!(
            r#"<text class="tick" x="{middle_px}" y="{:.1}" text-anchor="middle">simulated seconds; percent of episodes</text>"#,
            HEIGHT_PX - 4.0
        )
}
