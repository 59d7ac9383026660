//! Check of attribute values against the accepted ones.

use super::{Sign, Takes};

/// Returns a description of the accepted values, or `None` if the value is accepted.
pub(in crate::mjcf) fn wanted(value: &str, takes: Takes) -> Option<String> {
    let (right, wanted) = match takes {
        Takes::Text | Takes::Class | Takes::NameOf(_) => return None,
        Takes::Only(values) => (is_one_of(value, values), one_of(values)),
        Takes::Word(words) => (words.contains(&value), one_of(words)),
        Takes::Numbers { least, most, sign } => {
            let right = numbers(value).is_some_and(|numbers| {
                (least..=most).contains(&numbers.len()) && numbers.iter().all(|number| sign.allows(*number))
            });
            (right, format!("{} {}{}", count(least, most), plural(most), sign.words()))
        }
        Takes::Direction(count) => {
            let right =
                numbers(value).is_some_and(|numbers| numbers.len() == count && is_direction(&numbers[..3]));
            (right, format!("{count} numbers, the first three not all 0"))
        }
        Takes::Quaternion => {
            let right = numbers(value).is_some_and(|numbers| numbers.len() == 4 && is_direction(&numbers));
            (right, "4 numbers (w x y z), not all 0".into())
        }
        Takes::Axes => {
            let right = numbers(value).is_some_and(|numbers| {
                numbers.len() == 6 && is_direction(&cross(&numbers[..3], &numbers[3..]))
            });
            (right, "6 numbers, two directions that are not parallel".into())
        }
        Takes::AxisSequence => {
            let right = value.len() == 3 && value.chars().all(|letter| "xyzXYZ".contains(letter));
            (right, "three of the letters xyzXYZ".into())
        }
    };
    (!right).then_some(wanted)
}

/// Compares numbers as numbers; omitted ones are 0.
pub(in crate::mjcf) fn is_one_of(value: &str, values: &[&str]) -> bool {
    values.iter().any(|usual| match (numbers(value), numbers(usual)) {
        (Some(have), Some(usual)) => {
            let at = |numbers: &[f64], index: usize| numbers.get(index).copied().unwrap_or(0.0);
            (0..have.len().max(usual.len())).all(|index| at(&have, index) == at(&usual, index))
        }
        _ => value == *usual,
    })
}

impl Sign {
    fn allows(self, number: f64) -> bool {
        match self {
            Sign::Any => true,
            Sign::NotNegative => number >= 0.0,
            Sign::Positive => number > 0.0,
        }
    }

    fn words(self) -> &'static str {
        match self {
            Sign::Any => "",
            Sign::NotNegative => " of at least 0",
            Sign::Positive => " above 0",
        }
    }
}

/// Parses finite numbers separated by blanks.
fn numbers(value: &str) -> Option<Vec<f64>> {
    let finite = |word: &str| word.parse().ok().filter(|number: &f64| number.is_finite());
    value.split_ascii_whitespace().map(finite).collect()
}

fn is_direction(numbers: &[f64]) -> bool {
    numbers.iter().map(|number| number * number).sum::<f64>() > 1e-20
}

fn cross(a: &[f64], b: &[f64]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn one_of(words: &[&str]) -> String {
    match words {
        [word] => format!("`{word}`"),
        [words @ .., last] => format!("{} or {last}", words.join(", ")),
        [] => String::new(),
    }
}

fn count(least: usize, most: usize) -> String {
    match (least, most) {
        (0, usize::MAX) => "finite".into(),
        (least, most) if least == most => least.to_string(),
        (least, most) => format!("{least} to {most}"),
    }
}

fn plural(most: usize) -> &'static str {
    if most == 1 { "number" } else { "numbers" }
}
