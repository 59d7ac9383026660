//! Sets of seeds, as text.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

/// Seeds, written as `0-9,12`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct SeedList(pub BTreeSet<u32>);

impl From<SeedList> for String {
    fn from(SeedList(seeds): SeedList) -> String {
        let mut ranges: Vec<(u32, u32)> = Vec::new();
        for seed in seeds {
            match ranges.last_mut() {
                Some((_, last)) if last.checked_add(1) == Some(seed) => *last = seed,
                _ => ranges.push((seed, seed)),
            }
        }
        let range =
            |(first, last)| if first == last { format!("{first}") } else { format!("{first}-{last}") };
        ranges.into_iter().map(range).collect::<Vec<_>>().join(",")
    }
}

impl TryFrom<String> for SeedList {
    type Error = String;

    fn try_from(text: String) -> Result<SeedList, String> {
        let number = |text: &str| text.parse::<u32>().map_err(|_| format!("{text:?} is no seed"));
        let mut seeds = BTreeSet::new();
        for range in text.split(',').filter(|range| !range.is_empty()) {
            let (first, last) = range.split_once('-').unwrap_or((range, range));
            seeds.extend(number(first)?..=number(last)?);
        }
        Ok(SeedList(seeds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_are_written_as_ranges() {
        for (seeds, text) in [(vec![], ""), (vec![7], "7"), (vec![3, 0, 1, 2, 9, 11, 12], "0-3,9,11-12")] {
            let list = SeedList(seeds.into_iter().collect());
            assert_eq!(String::from(list.clone()), text);
            assert_eq!(SeedList::try_from(text.to_owned()), Ok(list));
        }
        assert!(SeedList::try_from("0-x".to_owned()).is_err());
    }
}
