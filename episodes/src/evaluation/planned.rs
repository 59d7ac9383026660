//! How many episodes an evaluation is to have, for whoever looks on while it is played.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{EvaluationError, Shard};
use crate::output::write_whole;

/// What the file is called where one process plays everything, and what it begins with where each plays a share.
const WHOLE: &str = "planned.json";
const SHARE: &str = "planned-";

/// How many episodes a share of an evaluation has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedEpisodes {
    pub episodes: usize,
}

impl PlannedEpisodes {
    /// Writes it into the folder of the evaluation.
    pub(super) fn write(self, folder: &Path, shard: Shard) -> Result<(), EvaluationError> {
        let name = match shard {
            Shard::WHOLE => WHOLE.into(),
            Shard { index, of } => format!("{SHARE}{index}-of-{of}.json"),
        };
        Ok(write_whole(&folder.join(name), serde_json::to_string(&self)?.as_bytes())?)
    }

    /// How many episodes all shares of an evaluation have that have begun; `None` where no share has said it.
    pub fn read_all(folder: &Path) -> Option<usize> {
        let read = |path: PathBuf| serde_json::from_slice::<PlannedEpisodes>(&fs::read(path).ok()?).ok();
        if let Some(whole) = read(folder.join(WHOLE)) {
            return Some(whole.episodes);
        }
        let files = fs::read_dir(folder).ok()?.flatten();
        let shares = files.filter(|file| file.file_name().to_string_lossy().starts_with(SHARE));
        let counts: Vec<usize> = shares.filter_map(|file| Some(read(file.path())?.episodes)).collect();
        (!counts.is_empty()).then(|| counts.iter().sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_added_up() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(PlannedEpisodes::read_all(folder.path()), None);
        for (index, episodes) in [(0, 3), (1, 2)] {
            PlannedEpisodes { episodes }.write(folder.path(), Shard { index, of: 2 }).unwrap();
        }
        assert_eq!(PlannedEpisodes::read_all(folder.path()), Some(5));
    }
}
