//! Report of `tandem replay --phases` on the phase that an episode did not reach.

use std::fmt::Write;

use tandem_episodes::Recording;
use tandem_episodes::replay::{Closest, ConditionTrace, Held, Moment, PartTrace, PhaseTrace};

/// Describes the conditions of the next phase. Each part is named by its position in the task's file.
pub fn told(recording: &Recording) -> Result<String, Box<dyn std::error::Error>> {
    let Some(trace) = PhaseTrace::of(recording)? else { return Ok("  all phases were reached\n".into()) };
    let PhaseTrace { number, id, from_s, to_s, nearest, description, conditions } = trace;
    let Moment { best, time_s } = nearest;
    let mut told = format!(
        "  {number} {id} was next from {from_s:.2} s to {to_s:.2} s and not reached; it came to {best:.2} of 1, at {time_s:.2} s\n"
    );
    writeln!(told, "  {description}\n  {} asks for:", recording.spec.task.source.name)?;
    let rows: Vec<[String; 4]> = conditions.iter().flat_map(rows).collect();
    let widths: [usize; 3] =
        std::array::from_fn(|column| rows.iter().map(|row| row[column].len()).max().unwrap_or(0));
    for [place, setting, held, text] in &rows {
        let [place_chars, setting_chars, held_chars] = widths;
        let row = format!("    {place:place_chars$}  {setting:setting_chars$}  {held:held_chars$}  {text}");
        writeln!(told, "{}", row.trim_end())?;
    }
    Ok(told)
}

/// Returns a row for each part of a condition, and one for all parts at once. A row has the position, the
/// setting, the time during which the part held, and its text.
fn rows(condition: &ConditionTrace) -> Vec<[String; 4]> {
    let ConditionTrace { setting, for_s, held, parts, most_at_once } = condition;
    let part = |(index, part): (usize, &PartTrace)| {
        let [line, column] = part.place;
        let setting = if index == 0 { setting.name() } else { "" };
        let nearest = part.nearest.map_or(String::new(), |nearest| format!("; nearest {}", near(nearest)));
        [format!("{line}:{column}"), setting.into(), held_told(&part.held, &nearest), part.text.clone()]
    };
    let mut rows: Vec<[String; 4]> = parts.iter().enumerate().map(part).collect();
    if parts.len() > 1 || *for_s > 0.0 {
        let Moment { best, time_s } = most_at_once;
        let most = match parts.len() {
            1 => String::new(),
            all => format!("; {best} of {all} at {time_s:.2} s"),
        };
        let at_once = held_told(held, &most) + &without_break(held, *for_s);
        let what = if parts.len() > 1 { "all at once" } else { "" };
        rows.push(["".into(), "".into(), at_once, what.into()]);
    }
    rows
}

/// Describes the longest uninterrupted time, if the condition has to hold for a certain time.
fn without_break(held: &Held, for_s: f64) -> String {
    match for_s > 0.0 {
        true => format!("; without a break {:.2} s of {for_s}", held.longest_s()),
        false => String::new(),
    }
}

/// Describes the times at which a condition held. If it never did, `nearest` is added.
fn held_told(held: &Held, nearest: &str) -> String {
    match held.first_s {
        None => format!("never{nearest}"),
        Some(_) if held.steps == held.of => "throughout".into(),
        Some(first_s) => format!("{:.2} s in all, first at {first_s:.2} s", held.total_s()),
    }
}

fn near(Moment { best, time_s }: Moment<Closest>) -> String {
    match best {
        Closest::Sides([left, right]) => {
            format!("{} against {}, at {time_s:.2} s", rounded(left), rounded(right))
        }
        Closest::Share(share) => format!("{share:.2} of 1, at {time_s:.2} s"),
    }
}

/// Rounds to four decimals, which is a tenth of a millimetre for lengths.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
