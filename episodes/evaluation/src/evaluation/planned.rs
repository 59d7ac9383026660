//! Number of an evaluation's planned episodes, and its state, for other processes that display them.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tandem_episodes::write_whole;

use super::{EvaluationError, Shard};

/// Name of the file if one process plays all episodes; `SHARE` is the prefix of its name if each process
/// plays a share.
const WHOLE: &str = "planned.json";
const SHARE: &str = "planned-";

/// Number of episodes in a share of an evaluation, and the share's state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlannedEpisodes {
    pub episodes: usize,
    /// Number of episodes that could not be started; known at the end.
    #[serde(default)]
    pub left_out: usize,
    /// `None` in files of earlier builds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<RunState>,
}

/// State of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    /// It is being played, or its process was killed before it could write another state.
    Playing,
    /// It has ended.
    Complete,
    /// An error has stopped it.
    Stopped,
}

impl PlannedEpisodes {
    /// Writes the file into the folder of the evaluation.
    pub(super) fn write(self, folder: &Path, shard: Shard) -> Result<(), EvaluationError> {
        let name = match shard {
            Shard::WHOLE => WHOLE.into(),
            Shard { index, of } => format!("{SHARE}{index}-of-{of}.json"),
        };
        Ok(write_whole(&folder.join(name), serde_json::to_string(&self)?.as_bytes())?)
    }

    /// Reads the files of all shares that have begun, and combines them; `None` if no share has written a
    /// file.
    pub fn read_all(folder: &Path) -> Option<PlannedEpisodes> {
        let read = |path: PathBuf| serde_json::from_slice::<PlannedEpisodes>(&fs::read(path).ok()?).ok();
        if let Some(whole) = read(folder.join(WHOLE)) {
            return Some(whole);
        }
        let files = fs::read_dir(folder).ok()?.flatten();
        let shares = files.filter(|file| file.file_name().to_string_lossy().starts_with(SHARE));
        shares.filter_map(|file| read(file.path())).reduce(PlannedEpisodes::with)
    }

    /// Combines two shares. The result is `Playing` if either share is.
    fn with(self, other: PlannedEpisodes) -> PlannedEpisodes {
        let state = match (self.state, other.state) {
            (Some(RunState::Complete), Some(RunState::Complete)) => Some(RunState::Complete),
            (Some(RunState::Playing), _) | (_, Some(RunState::Playing)) => Some(RunState::Playing),
            (Some(RunState::Stopped), Some(_)) | (Some(_), Some(RunState::Stopped)) => {
                Some(RunState::Stopped)
            }
            (None, _) | (_, None) => None,
        };
        PlannedEpisodes {
            episodes: self.episodes + other.episodes,
            left_out: self.left_out + other.left_out,
            state,
        }
    }
}

/// Returns `true` if an evaluation uses this file name for its planned episodes.
pub(super) fn is_planned_file(name: &str) -> bool {
    name == WHOLE || (name.starts_with(SHARE) && name.ends_with(".json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_added_up() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(PlannedEpisodes::read_all(folder.path()), None);
        for (index, episodes, state) in [(0, 3, RunState::Complete), (1, 2, RunState::Playing)] {
            let share = PlannedEpisodes { episodes, left_out: 1, state: Some(state) };
            share.write(folder.path(), Shard { index, of: 2 }).unwrap();
        }
        let all = PlannedEpisodes { episodes: 5, left_out: 2, state: Some(RunState::Playing) };
        assert_eq!(PlannedEpisodes::read_all(folder.path()), Some(all));
    }

    #[test]
    fn what_an_earlier_build_wrote_is_read() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(WHOLE), r#"{"episodes": 4}"#).unwrap();
        let read = PlannedEpisodes { episodes: 4, left_out: 0, state: None };
        assert_eq!(PlannedEpisodes::read_all(folder.path()), Some(read));
    }
}
