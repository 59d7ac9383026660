//! Tables of numbers in a policy's reply.

use crate::{error::RemoteError, values::ReplyValue};

/// Returns the numbers under `key`, which must be rows of `width` numbers.
pub fn find<'a>(
    answer: &'a ReplyValue,
    key: &str,
    width: usize,
    rows: Option<usize>,
) -> Result<&'a [f64], RemoteError> {
    let expected = match rows {
        Some(rows) => format!("expected an array of shape [{rows}, {width}] under the key {key:?}"),
        None => format!("expected an array of shape [rows, {width}] under the key {key:?}"),
    };
    let misfit = |came: String| RemoteError::Misfit(format!("{expected}; came {came}"));
    let value = answer.at(key).ok_or_else(|| match answer {
        ReplyValue::Array { .. } => misfit(format!(
            "{} without a key: answer with a map that has the key {key:?}, or make \"\" the key in [action]",
            answer.describe()
        )),
        _ => misfit(answer.describe()),
    })?;
    let ReplyValue::Array { shape, values } = value else { return Err(misfit(value.describe())) };
    let (have_rows, have_width) = match shape[..] {
        // A table with one column, or with one row.
        [length] if width == 1 => (length, 1),
        [length] => (1, length),
        [.., rows, width] => (rows, width),
        [] => (0, 0),
    };
    let batches: usize = shape.iter().rev().skip(2).product();
    if (batches, have_width) != (1, width) || have_rows == 0 || rows.is_some_and(|rows| rows != have_rows) {
        return Err(misfit(value.describe()));
    }
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(values),
        Some(at) => Err(RemoteError::Misfit(format!(
            "the number in row {}, column {} under the key {key:?} is {}; expected finite numbers",
            at / width,
            at % width,
            values[at]
        ))),
    }
}
