//! Finished episodes in the runs folder: their list, a recording for playback, images, films and files.

use std::{
    fs,
    path::{Component, Path, PathBuf},
    time::SystemTime,
};

use axum::{
    extract::{Query, State},
    http::header,
    response::{IntoResponse, Response},
};
use serde_json::{Map, Value, json};
use tandem_episodes::{EpisodeError, RESULT_FILE, Recording, replay::short_film};

use super::Wanted;
use crate::{
    hosting::HostingError,
    http::{
        app::AppState,
        problem::ApiError,
        watching::{RECORDING, no_recording, unreadable},
    },
};

/// Maximum number of listed episodes, newest first.
const MAX_LISTED: usize = 500;

/// Depth of the search for episodes below the runs folder. An evaluation keeps its episodes in subfolders.
const DEPTH: usize = 4;

/// Result fields in the list. With all their fields, hundreds of results would take megabytes.
const LISTED_FIELDS: [&str; 10] =
    ["task", "seed", "protocol", "phases", "success", "ended", "env_steps", "tool_calls", "falls", "usage"];

/// Files of an episode's folder that may be fetched, with their media types.
const FILES: [(&str, &str); 4] = [
    (RECORDING, "application/octet-stream"),
    (RESULT_FILE, "application/json"),
    ("strip.png", "image/png"),
    ("report.html", "text/html; charset=utf-8"),
];

/// Lists the finished episodes below `runs`, newest first, without those that are `running`.
pub fn list(runs: &Path, running: &[String]) -> Vec<Value> {
    let mut found = Vec::new();
    collect(runs, DEPTH, &mut found);
    found.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
    let entry = |(at, folder): (SystemTime, PathBuf)| {
        let run = folder.strip_prefix(runs).ok()?.to_str()?.replace('\\', "/");
        if running.contains(&run) {
            return None;
        }
        let mut result = read_object(&folder.join(RESULT_FILE))?;
        result.retain(|field, _| LISTED_FIELDS.contains(&field.as_str()));
        let policy = policy_of(&folder, &result);
        let ended_s = at.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let recorded = folder.join(RECORDING).is_file();
        let strip = folder.join("strip.png").is_file();
        Some(json!({
            "run": run,
            "policy": policy,
            "result": result,
            "ended_unix_s": ended_s,
            "recorded": recorded,
            "strip": strip,
        }))
    };
    found.into_iter().filter_map(entry).take(MAX_LISTED).collect()
}

fn read_object(path: &Path) -> Option<Map<String, Value>> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

/// Returns the name of the policy that played an episode, from the evaluation's file beside the episode's
/// folder. Without that file, returns the models in the result's usage, if there are any.
fn policy_of(folder: &Path, result: &Map<String, Value>) -> Option<String> {
    let entry = read_object(&folder.with_added_extension("json"));
    let named = entry.and_then(|entry| entry.get("policy")?.as_str().map(str::to_owned));
    named.or_else(|| {
        let models = result.get("usage")?["models"].as_array()?;
        let models: Vec<&str> = models.iter().filter_map(Value::as_str).collect();
        (!models.is_empty()).then(|| models.join(", "))
    })
}

fn collect(folder: &Path, depth: usize, found: &mut Vec<(SystemTime, PathBuf)>) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir())) {
        let path = entry.path();
        match fs::metadata(path.join(RESULT_FILE)).and_then(|file| file.modified()) {
            Ok(at) => found.push((at, path)),
            Err(_) if depth > 1 => collect(&path, depth - 1, found),
            Err(_) => {}
        }
    }
}

fn folder(app: &AppState, wanted: &Wanted) -> Result<PathBuf, ApiError> {
    folder_of(app, wanted.run.clone().unwrap_or_default())
}

/// Returns the folder that a page names, after checking that it is an episode's folder below the runs
/// folder.
pub fn folder_of(app: &AppState, run: String) -> Result<PathBuf, ApiError> {
    let named = Path::new(&run);
    let below = !run.is_empty() && named.components().all(|part| matches!(part, Component::Normal(_)));
    let folder = app.settings.runs.join(named);
    match below && folder.join(RESULT_FILE).is_file() {
        true => Ok(folder),
        false => Err(ApiError::NoRun { run }),
    }
}

/// Returns the data with which a page draws a finished episode.
pub async fn run(State(app): State<AppState>, Query(wanted): Query<Wanted>) -> Result<Response, ApiError> {
    let folder = folder(&app, &wanted)?;
    let textures = app.textures.clone();
    let message = app.recordings.read(move |last| {
        let opened = last.open(&folder)?;
        textures.add(opened.episode.textures());
        Ok(opened.message())
    });
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], message.await?).into_response())
}

/// Renders a robot's camera image at a moment as a PNG file.
pub async fn picture(app: AppState, wanted: Wanted) -> Result<Vec<u8>, ApiError> {
    let folder = folder(&app, &wanted)?;
    let drawn = app.recordings.read(move |last| {
        let episode = &last.open(&folder)?.episode;
        let name = wanted.robot.unwrap_or_default();
        let drawn = episode.picture(wanted.time_s.unwrap_or_default(), &name);
        let have = episode.robots().map(str::to_owned).collect();
        let drawn = drawn.ok_or(EpisodeError::UnknownRobot { name, have }).map_err(HostingError::from)?;
        drawn.map_err(|failed| ApiError::Reply(failed.into()))
    });
    drawn.await
}

/// Renders a short film of the episode.
pub async fn film(State(app): State<AppState>, Query(wanted): Query<Wanted>) -> Result<Response, ApiError> {
    let folder = folder(&app, &wanted)?;
    let made = app.films.read(move |_| {
        let recording = Recording::read(&folder.join(RECORDING)).map_err(|error| unreadable(&error))?;
        short_film(&recording).map_err(|error| unreadable(&error))
    });
    Ok(([(header::CONTENT_TYPE, "image/webp")], made.await?.webp).into_response())
}

/// Returns a file of the episode's folder.
pub async fn file(State(app): State<AppState>, Query(wanted): Query<Wanted>) -> Result<Response, ApiError> {
    let folder = folder(&app, &wanted)?;
    let asked = wanted.file.unwrap_or_default();
    let found = FILES.iter().find(|(name, _)| *name == asked);
    let (name, kind) =
        *found.ok_or(ApiError::NoRun { run: format!("{}/{asked}", wanted.run.unwrap_or_default()) })?;
    let read = app.recordings.read(move |_| fs::read(folder.join(name)).map_err(|_| no_recording(&folder)));
    let bytes = read.await?;
    let headers = [
        (header::CONTENT_TYPE, kind.to_owned()),
        // A report is a separate page; its scripts are disabled.
        (
            header::CONTENT_SECURITY_POLICY,
            "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'".into(),
        ),
        (header::CONTENT_DISPOSITION, format!("inline; filename=\"{name}\"")),
    ];
    Ok((headers, bytes).into_response())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lists a folder that has one finished episode with these files, and returns the policies in the list.
    fn listed(result: &Value, entry: Option<&Value>) -> Vec<Value> {
        let runs = tempfile::tempdir().unwrap();
        let folder = runs.path().join("run/episodes/handover.v1-7");
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join(RESULT_FILE), result.to_string()).unwrap();
        if let Some(entry) = entry {
            fs::write(runs.path().join("run/episodes/handover.v1-7.json"), entry.to_string()).unwrap();
        }
        list(runs.path(), &[])
    }

    #[test]
    fn an_episode_names_who_played_it() {
        let result = json!({ "task": "handover", "state_hash": "12ab" });
        let models = json!({ "task": "handover", "usage": { "models": ["one", "other"] } });
        let entry = json!({ "policy": "expert", "task": "handover" });
        for (result, entry, policy) in [
            (&result, None, Value::Null),
            (&models, None, json!("one, other")),
            (&models, Some(&entry), json!("expert")),
        ] {
            let listed = listed(result, entry);
            assert_eq!((listed.len(), &listed[0]["policy"]), (1, &policy));
            assert_eq!(listed[0]["run"], "run/episodes/handover.v1-7");
            assert_eq!(listed[0]["result"]["task"], "handover");
            assert!(listed[0]["result"].get("state_hash").is_none(), "{listed:?}");
        }
    }
}
