//! What an episode came to, as `result.json`.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tandem_tools_spec::{PhaseTimes, ResultReply};

use crate::output::{OutputError, write_whole};

/// The content of `result.json`. Field order is the file's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EpisodeResult {
    pub task: String,
    pub seed: u32,
    /// Simulated seconds at which each phase was reached; null where it was not.
    pub phases: PhaseTimes,
    /// Control steps of 20 ms, the initial hold included.
    pub env_steps: u32,
    pub tool_calls: u32,
    /// Robots that fell.
    pub falls: u32,
    /// Simulated seconds per second of physics.
    pub realtime_factor: f64,
    /// Of the whole physical state at the end, 16 hexadecimal digits.
    pub state_hash: String,
}

impl EpisodeResult {
    pub const FILE_NAME: &str = "result.json";

    /// Writes `result.json` into a run folder. A reader sees the old file or the new one, never a part.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, OutputError> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        let path = folder.join(Self::FILE_NAME);
        write_whole(&path, text.as_bytes())?;
        Ok(path)
    }
}

impl From<&ResultReply> for EpisodeResult {
    fn from(reply: &ResultReply) -> Self {
        EpisodeResult {
            task: reply.task.clone(),
            seed: reply.seed,
            phases: reply.phases.clone(),
            env_steps: reply.env_steps,
            tool_calls: reply.tool_calls,
            falls: reply.falls,
            realtime_factor: reply.realtime_factor,
            state_hash: reply.state_hash.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::json;

    use super::*;

    fn result(p3_s: Option<f64>) -> EpisodeResult {
        EpisodeResult {
            task: "handover".into(),
            seed: 3,
            phases: PhaseTimes(vec![
                ("p1".into(), Some(4.2)),
                ("p2".into(), Some(9.86)),
                ("p3".into(), p3_s),
            ]),
            env_steps: 812,
            tool_calls: 61,
            falls: 0,
            realtime_factor: 3.5,
            state_hash: "00c0ffee00c0ffee".into(),
        }
    }

    #[test]
    fn result_json_has_the_agreed_keys() {
        let folder = tempfile::tempdir().unwrap();
        for (p3_s, p3) in [(None, json!(null)), (Some(14.0), json!(14.0))] {
            let path = result(p3_s).write(folder.path()).unwrap();
            let written: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
            let expected = json!({
                "task": "handover", "seed": 3, "phases": {"p1": 4.2, "p2": 9.86, "p3": p3}, "env_steps": 812,
                "tool_calls": 61, "falls": 0, "realtime_factor": 3.5, "state_hash": "00c0ffee00c0ffee",
            });
            assert_eq!(written, expected);
            assert_eq!(serde_json::from_value::<EpisodeResult>(written).unwrap(), result(p3_s));
        }
        let names: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names, ["result.json"], "no partial file stays behind");
    }

    #[test]
    fn a_missing_folder_is_an_error_that_names_the_file() {
        let error = result(None).write(Path::new("/nonexistent/run")).unwrap_err();
        assert!(error.to_string().contains("/nonexistent/run/result.json"), "{error}");
    }
}
