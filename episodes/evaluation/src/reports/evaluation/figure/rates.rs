//! Figure of the rates of one task's phases. Each rate has a mark on a line from 0 to 100 %, and an interval.

use tandem_episodes::html::escape;

use super::{Figure, colour_class};
use crate::reports::evaluation::policy::{PhaseReport, PolicyReport};
use crate::reports::evaluation::rate::Rate;

/// Function that draws a mark at a point.
type Mark = fn(f64, f64) -> String;

/// A mark for each kind of rate, and its meaning.
pub const MARKS: [(Mark, &str); 3] = [
    (disc, "cumulative: of all episodes"),
    (diamond, "conditional: of those that reached the phase before"),
    (square, "from the phase's own beginning"),
];

/// Returns the marks that occur in drawings of these policies.
pub fn marks(policies: &[PolicyReport]) -> &'static [(Mark, &'static str)] {
    let begun = policies.iter().any(|policy| policy.phase_level.is_some());
    if begun { &MARKS } else { &MARKS[..2] }
}

const WIDTH_PX: f64 = 360.0;
/// Horizontal position of 0 %; `RIGHT_PX` is the position of 100 %.
const LEFT_PX: f64 = 8.0;
const RIGHT_PX: f64 = 296.0;
const HEADING_PX: f64 = 22.0;
const LANE_PX: f64 = 13.0;
const GAP_PX: f64 = 5.0;
const AXIS_PX: f64 = 20.0;

/// Draws the rates of one task; `None` if no policy has played it.
pub fn figure(task: &str, policies: &[PolicyReport]) -> Option<Figure> {
    let played: Vec<(usize, &[PhaseReport])> = policies
        .iter()
        .enumerate()
        .filter_map(|(index, policy)| {
            let of_task = policy.tasks.iter().find(|of_task| of_task.task == task)?;
            Some((index, of_task.phases.as_slice()))
        })
        .collect();
    let (_, phases) = played.first()?;
    let (mut drawn, mut y_px) = (String::new(), 0.0);
    for (number, phase) in phases.iter().enumerate() {
        drawn += &heading(phase, y_px);
        y_px += HEADING_PX;
        for (index, phases) in &played {
            let lanes = lanes(&policies[*index].name, &phases[number]);
            drawn += &format!(r#"<g class="{}">"#, colour_class(*index));
            for (mark, label, rate) in lanes {
                drawn += &lane(mark, &label, rate, y_px + LANE_PX / 2.0);
                y_px += LANE_PX;
            }
            drawn += "</g>";
            y_px += GAP_PX;
        }
    }
    Some(Figure {
        title: task.into(),
        label: format!("Rates of the phases of {task}"),
        width_px: WIDTH_PX,
        height_px: y_px + AXIS_PX,
        shapes: axis(y_px) + &drawn,
    })
}

fn heading(phase: &PhaseReport, y_px: f64) -> String {
    let name = escape(&phase.id.replace('_', " "));
    let together = match phase.collaborative {
        true => r#"<tspan class="together" dx="8">together</tspan>"#,
        false => "",
    };
    format!(
        r#"<text class="phase" x="{LEFT_PX}" y="{:.1}">{} {name}{together}</text>"#,
        y_px + 15.0,
        phase.number
    )
}

/// Returns the known rates of a phase, each with its mark and its description.
fn lanes(policy: &str, phase: &PhaseReport) -> Vec<(Mark, String, Rate)> {
    let rates = [phase.cumulative, phase.conditional, phase.from_its_beginning];
    // The first phase has no predecessor.
    let said = |kind: usize| kind != 1 || phase.conditional != phase.cumulative || phase.number != "p1";
    let lanes = MARKS.iter().zip(rates).enumerate().filter(|(kind, _)| said(*kind));
    lanes
        .filter_map(|(_, ((mark, meaning), rate))| {
            let rate = rate?;
            let label =
                format!("{policy}, {} {meaning}: {} %, {}", phase.number, rate.text(), rate.fraction());
            Some((*mark, label, rate))
        })
        .collect()
}

fn lane(mark: Mark, label: &str, rate: Rate, y_px: f64) -> String {
    let [from_px, to_px] = rate.interval_share.map(x_px);
    format!(
        r#"<g><title>{}</title><line class="interval" x1="{from_px:.1}" x2="{to_px:.1}" y1="{y_px:.1}" y2="{y_px:.1}"/>{}<text class="count" x="{:.1}" y="{:.1}">{}</text></g>"#,
        escape(label),
        mark(x_px(rate.share), y_px),
        WIDTH_PX - 4.0,
        y_px + 3.8,
        rate.fraction(),
    )
}

fn x_px(share: f64) -> f64 {
    LEFT_PX + share * (RIGHT_PX - LEFT_PX)
}

/// Renders lines and numbers from 0 to 100 %, down to `bottom_px`.
fn axis(bottom_px: f64) -> String {
    let tick = |percent: u32| {
        let x_px = x_px(f64::from(percent) / 100.0);
        let unit = if percent == 100 { " %" } else { "" };
        let anchor = match percent {
            0 => "start",
            100 => "end",
            _ => "middle",
        };
        format!(
            r#"<line class="grid" x1="{x_px:.1}" x2="{x_px:.1}" y1="{HEADING_PX}" y2="{bottom_px:.1}"/><text class="tick" x="{x_px:.1}" y="{:.1}" text-anchor="{anchor}">{percent}{unit}</text>"#,
            bottom_px + 13.0
        )
    };
    [0, 25, 50, 75, 100].map(tick).concat()
}

fn disc(x_px: f64, y_px: f64) -> String {
    format!(r#"<circle class="full" cx="{x_px:.1}" cy="{y_px:.1}" r="4.2"/>"#)
}

fn diamond(x_px: f64, y_px: f64) -> String {
    format!(r#"<path class="hollow" d="M{:.1} {y_px:.1}l4.4 -4.4l4.4 4.4l-4.4 4.4z"/>"#, x_px - 4.4)
}

fn square(x_px: f64, y_px: f64) -> String {
    format!(r#"<rect class="hollow" x="{:.1}" y="{:.1}" width="7.4" height="7.4"/>"#, x_px - 3.7, y_px - 3.7)
}
