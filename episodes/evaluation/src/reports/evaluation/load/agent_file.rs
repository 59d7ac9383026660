//! Policy of an episode that `tandem agent` has played, read from the file with its flags.

use std::fs;
use std::path::Path;

use crate::results::PolicyCard;
use serde::Deserialize;
use serde_json::{Map, Value};

/// File in an episode's folder with the flags of `tandem agent`.
const AGENT_FILE: &str = "agent.json";

/// Flags that are not settings of the model: episode settings, and limits that may change when play is
/// resumed.
const OTHER_FLAGS: [&str; 12] = [
    "task",
    "seed",
    "assistance",
    "base_url",
    "context_tokens",
    "max_tokens_total",
    "max_usd",
    "max_calls",
    "max_seconds",
    "usd_per_million_input",
    "usd_per_million_output",
    "usd_per_million_cached",
];

/// The part of the file that is read here; operators' tokens are not read.
#[derive(Deserialize)]
struct AgentFile {
    flags: Map<String, Value>,
}

/// Returns the policy that played the episode in this folder; `None` if no file names it.
pub fn card(folder: &Path) -> Option<PolicyCard> {
    let AgentFile { mut flags } = serde_json::from_slice(&fs::read(folder.join(AGENT_FILE)).ok()?).ok()?;
    let model = flags.remove("model")?.as_str()?.to_owned();
    let per_robot = if flags.get("per_robot") == Some(&Value::Bool(true)) { " per robot" } else { "" };
    flags.retain(|name, value| !OTHER_FLAGS.contains(&name.as_str()) && !value.is_null());
    let name = format!("agent:{model}{per_robot}");
    Some(PolicyCard { settings: Some(flags.into()), ..PolicyCard::from(name.as_str()) })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_model_is_named_with_what_was_set_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let read = |text: &str| {
            fs::write(folder.path().join(AGENT_FILE), text).unwrap();
            card(folder.path())
        };
        assert_eq!(card(folder.path()), None);
        let flags = r#""api": "anthropic", "effort": null, "temperature": 0.2, "max_usd": 2, "seed": 7, "talk": true"#;
        let text = format!(
            r#"{{"flags": {{"model": "m-1", "per_robot": true, {flags}}}, "operators": [{{"token": "x"}}]}}"#
        );
        let found = read(&text).unwrap();
        assert_eq!(found.name, "agent:m-1 per robot");
        let settings = json!({"api": "anthropic", "per_robot": true, "talk": true, "temperature": 0.2});
        assert_eq!(found.settings, Some(settings));
        assert_eq!(read(&text.replace("true", "false")).unwrap().name, "agent:m-1");
        assert_eq!(read("{}"), None);
    }
}
