//! Seeds on the command line: `3`, or `0..9` with both ends included, as result tables name them.

use std::{ops::RangeInclusive, str::FromStr};

/// One seed or several in sequence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds(pub RangeInclusive<u32>);

/// Why a text names no seeds.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("{0:?} names no seeds; give one, as 3, or a range with both ends included, as 0..9")]
pub struct NoSeeds(String);

impl FromStr for Seeds {
    type Err = NoSeeds;

    fn from_str(text: &str) -> Result<Self, NoSeeds> {
        let number = |part: &str| part.parse::<u32>().map_err(|_| NoSeeds(text.into()));
        let range = match text.split_once("..").or_else(|| text.split_once('-')) {
            Some((first, last)) => number(first)?..=number(last)?,
            None => number(text)?..=number(text)?,
        };
        if range.is_empty() {
            return Err(NoSeeds(text.into()));
        }
        Ok(Seeds(range))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_name_seeds() {
        let check = |text: &str, expected: Option<RangeInclusive<u32>>| {
            assert_eq!(text.parse::<Seeds>().ok().map(|seeds| seeds.0), expected, "{text:?}");
        };
        check("0", Some(0..=0));
        check("7", Some(7..=7));
        check("0..9", Some(0..=9));
        check("0-9", Some(0..=9));
        check("4..4", Some(4..=4));
        check("9..0", None);
        check("-1", None);
        check("..9", None);
        check("ten", None);
        check("", None);
        check("4294967296", None);
    }
}
