//! Flags whose value is one of a few names.

use clap::builder::{PossibleValuesParser, TypedValueParser};

/// Reads one of `all` by its name; `--help` and the error of a wrong name list them.
pub fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.map(name)).try_map(move |found: String| {
        all.into_iter().find(|value| name(*value) == found).ok_or("not one of the names")
    })
}
