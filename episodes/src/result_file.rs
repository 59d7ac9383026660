//! The result of an episode as a file in its run folder.

use std::path::{Path, PathBuf};

use tandem_tools_spec::ResultReply;

use crate::output::{OutputError, write_whole};

/// Name of the result in a run folder.
pub const RESULT_FILE: &str = "result.json";

/// Writes `result.json` into a run folder. A reader sees the old file or the new one, never a part.
///
/// # Errors
///
/// If the file cannot be written.
pub fn write_result(result: &ResultReply, folder: &Path) -> Result<PathBuf, OutputError> {
    let mut text = serde_json::to_string_pretty(result)?;
    text.push('\n');
    let path = folder.join(RESULT_FILE);
    write_whole(&path, text.as_bytes())?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::json;
    use tandem_tools_spec::{Assistance, EndReason, PhaseTimes, Protocol};

    use super::*;

    fn result(p3_s: Option<f64>) -> ResultReply {
        ResultReply {
            task: "handover".into(),
            seed: Some(3),
            protocol: Protocol::Agentic,
            phases: PhaseTimes(vec![
                ("p1".into(), Some(4.2)),
                ("p2".into(), Some(9.86)),
                ("p3".into(), p3_s),
            ]),
            success: None,
            ended: EndReason::Finished,
            env_steps: 812,
            tool_calls: 61,
            requests: None,
            thinking_s: 0.0,
            operators: Vec::new(),
            falls: 0,
            realtime_factor: 3.5,
            state_hash: Some("00c0ffee00c0ffee".into()),
            simulator_failure: None,
            assistance: Assistance::Full,
            extra_information: vec![],
            extra_information_replies: Default::default(),
            joints_clamped_share: None,
            departures: vec![],
            recording_failed: None,
            usage: None,
        }
    }

    #[test]
    fn result_json_has_the_agreed_keys() {
        let folder = tempfile::tempdir().unwrap();
        for (p3_s, p3) in [(None, json!(null)), (Some(14.0), json!(14.0))] {
            let path = write_result(&result(p3_s), folder.path()).unwrap();
            let written: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
            let expected = json!({
                "task": "handover", "seed": 3, "protocol": "agentic", "phases": {"p1": 4.2, "p2": 9.86, "p3": p3},
                "assistance": "full", "ended": "finished", "env_steps": 812, "tool_calls": 61, "thinking_s": 0.0, "falls": 0, "realtime_factor": 3.5,
                "state_hash": "00c0ffee00c0ffee",
            });
            assert_eq!(written, expected);
            assert_eq!(serde_json::from_value::<ResultReply>(written).unwrap(), result(p3_s));
        }
        let names: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(names, ["result.json"], "no partial file stays behind");
    }

    #[test]
    fn a_missing_folder_is_an_error_that_names_the_file() {
        let error = write_result(&result(None), Path::new("/nonexistent/run")).unwrap_err();
        assert!(error.to_string().contains("/nonexistent/run/result.json"), "{error}");
    }
}
