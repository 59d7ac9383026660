//! What one of the programs of an episode is given: its folder, its brief, its environment.

use std::path::{Path, PathBuf};

use tandem_episodes::{EpisodeError, OutputError, create_private_folder, write_whole};
use tandem_tools_spec::{Driving, StartReply};

use super::brief::{self, brief};

/// What the server said at the start, for programs that read JSON.
const START_FILE: &str = "start.json";

/// The program that directs all robots, or that of one robot.
#[derive(Debug)]
pub struct Part<'a> {
    pub robot: Option<&'a str>,
    token: &'a str,
    /// Where its words are kept.
    pub folder: PathBuf,
}

impl<'a> Part<'a> {
    /// The parts in the episode `start`, whose files are in `folder`: one by the server's own `token`, or one for each operator.
    pub fn all(start: &'a StartReply, token: &'a str, folder: &Path) -> Vec<Part<'a>> {
        if start.operators.is_empty() {
            return vec![Part { robot: None, token, folder: folder.into() }];
        }
        let part =
            |robot: &'a str, token: &'a str| Part { robot: Some(robot), token, folder: folder.join(robot) };
        start.operators.iter().map(|operator| part(&operator.robot, &operator.token)).collect()
    }

    /// Writes what the program reads.
    pub fn write(&self, start: &StartReply, url: &str, driving: &Driving) -> Result<(), EpisodeError> {
        if self.robot.is_some() {
            create_private_folder(&self.folder)
                .map_err(|source| OutputError::Io { path: self.folder.clone(), source })?;
        }
        let text = brief(start, url, self.robot, driving);
        write_whole(&self.folder.join(brief::FILE), text.as_bytes())?;
        // Tokens are told to whom they belong, and kept nowhere.
        let mut told = StartReply { operators: Vec::new(), ..start.clone() };
        told.briefing.instructions.retain(|part| self.robot.is_none_or(|robot| robot == part.robot));
        let text = serde_json::to_string_pretty(&told).map_err(OutputError::from)?;
        Ok(write_whole(&self.folder.join(START_FILE), text.as_bytes())?)
    }

    /// What the program finds in its environment, beside ours.
    pub fn environment(&self, start: &StartReply, url: &str) -> Vec<(&'static str, String)> {
        let common = [
            ("TANDEM_URL", url.into()),
            ("TANDEM_EPISODE", start.episode_id.clone()),
            ("TANDEM_TOKEN", self.token.into()),
            ("TANDEM_START", self.folder.join(START_FILE).display().to_string()),
        ];
        common.into_iter().chain(self.robot.map(|robot| ("TANDEM_ROBOT", robot.into()))).collect()
    }
}
