//! Figures as stand-alone SVG files with fixed colours, for documents and converters.

use tandem_episodes::html::escape;

use super::times::LINES;
use super::{Figure, SERIES, colour_class, rates, times};
use crate::reports::evaluation::policy::PolicyReport;

/// Colours of policies, the same as on the page's light background.
const COLOURS: [&str; SERIES] = ["#2459c9", "#c2570c", "#17804a", "#8b3fb8", "#b8392b", "#0d7c8c"];

const STYLE: &str = "text { fill: #1d2024; font: 13.5px Helvetica, Arial, sans-serif; }
.phase { font-weight: 600; }
.title { font-size: 15px; font-weight: 600; }
.together { fill: #626973; font-style: italic; font-weight: 400; }
.count { fill: #626973; font-size: 12px; text-anchor: end; }
.tick { fill: #626973; font-size: 12px; }
.grid { stroke: #e3e4e0; stroke-width: 1; }
.interval { stroke: #1d2024; stroke-linecap: round; stroke-opacity: 0.38; stroke-width: 4; }
.full { fill: #1d2024; }
.hollow { fill: #ffffff; stroke: #1d2024; stroke-width: 1.6; }
.curve { fill: none; stroke: #1d2024; stroke-width: 1.8; }
.d1 { stroke-dasharray: 6 3; }
.d2 { stroke-dasharray: 2 3; }
.d3 { stroke-dasharray: 8 3 2 3; }
";

const MARGIN_PX: f64 = 16.0;
const TITLE_PX: f64 = 26.0;
const LEGEND_LINE_PX: f64 = 20.0;
/// Maximum number of drawings side by side.
const MAX_COLUMNS: usize = 3;
/// Maximum width of a character in the legend.
const LETTER_PX: f64 = 8.5;
/// Width of the mark at the start of a line in the legend.
const MARK_PX: f64 = 36.0;

/// A line of the legend: an SVG mark, its class, and its meaning.
struct LegendLine {
    mark: String,
    class: String,
    text: String,
}

/// Returns the file with the rates of all phases, one drawing per task.
pub fn rates_file(tasks: &[&str], policies: &[PolicyReport]) -> String {
    let marks = rates::marks(policies).iter();
    let legend = marks.map(|(mark, text)| LegendLine {
        mark: mark(MARK_PX / 2.0, 0.0),
        class: String::new(),
        text: (*text).into(),
    });
    let bar = LegendLine {
        mark: format!(r#"<line class="interval" x1="6" x2="{}" y1="0" y2="0"/>"#, MARK_PX - 6.0),
        class: String::new(),
        text: "exact interval of 95 %".into(),
    };
    let drawings = tasks.iter().filter_map(|task| rates::figure(task, policies)).collect();
    file(drawings, legend.chain([bar]).chain(colours(policies)).collect())
}

/// Returns the file with the curves of the times at which phases were reached, one drawing per task. The
/// legend names the tasks in which no phase was reached.
pub fn times_file(tasks: &[&str], policies: &[PolicyReport]) -> String {
    let phases = policies.iter().flat_map(|policy| &policy.tasks).map(|task| task.phases.len()).max();
    let line = |number: usize| LegendLine {
        mark: format!(r#"<path class="curve d{}" d="M4 0H{}"/>"#, number % LINES, MARK_PX - 4.0),
        class: String::new(),
        text: format!("{} reached by then", tandem_episodes::Phase::number(number)),
    };
    let mut legend: Vec<LegendLine> = (0..phases.unwrap_or_default()).map(line).collect();
    legend.extend(colours(policies));
    let (mut drawings, mut without) = (Vec::new(), Vec::new());
    for task in tasks {
        match times::figure(task, policies) {
            Some(drawing) => drawings.push(drawing),
            None => without.push(*task),
        }
    }
    if !without.is_empty() {
        let text = format!("No phase was reached of {}", without.join(", "));
        legend.push(LegendLine { mark: String::new(), class: String::new(), text });
    }
    file(drawings, legend)
}

fn colours(policies: &[PolicyReport]) -> impl Iterator<Item = LegendLine> {
    policies.iter().enumerate().map(|(index, policy)| LegendLine {
        mark: format!(r#"<circle class="full" cx="{}" cy="0" r="5"/>"#, MARK_PX / 2.0),
        class: colour_class(index),
        text: policy.name.clone(),
    })
}

/// Arranges drawings in columns under a legend.
fn file(drawings: Vec<Figure>, legend: Vec<LegendLine>) -> String {
    let (mut body, mut y_px) = (String::new(), MARGIN_PX);
    let mut width_px: f64 = 0.0;
    for LegendLine { mark, class, text } in &legend {
        y_px += LEGEND_LINE_PX;
        body += &format!(
            r#"<g class="{class}" transform="translate({MARGIN_PX} {:.1})">{mark}<text x="{MARK_PX}" y="4.5">{}</text></g>"#,
            y_px - LEGEND_LINE_PX / 2.0,
            escape(text)
        );
        width_px = width_px.max(MARK_PX + LETTER_PX * text.chars().count() as f64);
    }
    for row in drawings.chunks(MAX_COLUMNS) {
        let mut x_px = MARGIN_PX;
        y_px += MARGIN_PX;
        for drawing in row {
            body += &format!(
                r#"<g transform="translate({x_px:.1} {y_px:.1})"><text class="title" x="8" y="16">{}</text><g transform="translate(0 {TITLE_PX})">{}</g></g>"#,
                escape(&drawing.title),
                drawing.shapes
            );
            x_px += drawing.width_px + MARGIN_PX;
        }
        y_px += TITLE_PX + row.iter().map(|drawing| drawing.height_px).fold(0.0, f64::max);
        width_px = width_px.max(x_px - 2.0 * MARGIN_PX);
    }
    let (width_px, height_px) = (width_px + 2.0 * MARGIN_PX, y_px + MARGIN_PX);
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width_px:.0}" height="{height_px:.0}" viewBox="0 0 {width_px:.1} {height_px:.1}">
<style>
{STYLE}{}</style>
<rect width="100%" height="100%" fill="#ffffff"/>
{body}
</svg>
"##,
        COLOURS.iter().enumerate().map(colour_style).collect::<String>()
    )
}

fn colour_style((index, colour): (usize, &&str)) -> String {
    format!(
        ".c{index} .interval, .c{index} .hollow, .c{index} .curve {{ stroke: {colour}; }}\n.c{index} .full {{ fill: {colour}; }}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files have the same colours as the page.
    #[test]
    fn colours_are_those_of_the_page() {
        let page = tandem_episodes::html::page("", "");
        for (index, colour) in COLOURS.iter().enumerate() {
            assert!(page.contains(&format!("--s{index}: {colour}")), "{colour}");
            assert!(page.contains(&format!(".c{index} {{ --c: var(--s{index}); }}")), "c{index}");
        }
    }
}
