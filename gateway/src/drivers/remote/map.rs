//! Which numbers and pictures go under which key to a policy, and which come back: a small TOML file, or a preset.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{
    columns::{action_columns, state_columns},
    picture::{Fit, Layout},
};

/// Maps that the program carries, by name; each is written out and explained in its file.
pub const PRESETS: [(&str, &str); 2] =
    [("openpi", include_str!("maps/openpi.toml")), ("gr00t_n17_g1", include_str!("maps/gr00t_n17_g1.toml"))];

/// What stands for a robot's name in a key.
pub const ROBOT: &str = "{robot}";

/// The longest side of a picture that a policy is shown.
const LONGEST_SIDE_PX: u32 = 4096;

/// How a policy is asked and understood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyMap {
    pub scope: Scope,
    pub answer: AnswerScope,
    pub instruction: Words,
    /// Axes of length 1 before those of pictures and states.
    pub leading_axes: usize,
    /// How long a server may take to be there.
    pub connect_s: f64,
    /// How long an answer may take; the first of an episode may take longer.
    pub reply_s: f64,
    pub images: BTreeMap<String, ImageKey>,
    pub state: BTreeMap<String, Vec<String>>,
    pub prompt: BTreeMap<String, PromptForm>,
    pub action: BTreeMap<String, Vec<String>>,
    pub chunk: Chunk,
}

/// Which robots' views and joints a policy is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    /// Those of the robot that it is asked for.
    Local,
    /// Those of all robots, under keys with their names.
    Global,
}

/// Which robots an answer moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AnswerScope {
    /// The robot that it was asked for.
    One,
    /// Every robot.
    All,
}

/// What a policy is told to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Words {
    /// The robot's part of the task.
    Robot,
    /// The task of all robots.
    Joint,
}

/// Where and how a picture goes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageKey {
    pub camera: CameraName,
    /// Width and height in pixels; left out for the camera's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    #[serde(default)]
    pub fit: Fit,
    #[serde(default)]
    pub layout: Layout,
}

/// Which camera a picture comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraName {
    Egocentric,
    /// More than robots see.
    ThirdPerson,
}

/// How the instruction is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PromptForm {
    Text,
    List,
}

/// Rows of an answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chunk {
    /// How many there have to be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<usize>,
    /// How many of them are executed, from the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub execute: Option<usize>,
}

/// Why a map cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    #[error(
        "no policy map {name:?}: it is neither a preset ({}) nor a file that can be read: {source}",
        preset_names()
    )]
    Read { name: String, source: io::Error },
    #[error("the policy map {}: {source}", path.display())]
    Parse { path: PathBuf, source: toml::de::Error },
    #[error("the policy map {} names the preset {preset:?}; have: {}", path.display(), preset_names())]
    NoPreset { path: PathBuf, preset: String },
    #[error("the policy map {name}: {reason}")]
    Wrong { name: String, reason: String },
}

fn preset_names() -> String {
    PRESETS.map(|(name, _)| name).join(", ")
}

impl PolicyMap {
    /// The preset called `name`, or the map in the file of that name. A file may begin with `preset = "NAME"`; what it gives then
    /// replaces what the preset has, tables as a whole.
    pub fn find(name: &str) -> Result<PolicyMap, MapError> {
        let path = Path::new(name);
        let text = match preset(name) {
            Some(text) => text.to_owned(),
            None => {
                fs::read_to_string(path).map_err(|source| MapError::Read { name: name.into(), source })?
            }
        };
        let map = PolicyMap::parse(path, &text)?;
        map.check().map_err(|reason| MapError::Wrong { name: name.into(), reason })?;
        Ok(map)
    }

    fn parse(path: &Path, text: &str) -> Result<PolicyMap, MapError> {
        let unreadable = |source| MapError::Parse { path: path.into(), source };
        let mut given: toml::Table = toml::from_str(text).map_err(unreadable)?;
        let Some(name) = given.remove("preset") else { return toml::from_str(text).map_err(unreadable) };
        let name = name.as_str().unwrap_or_default();
        let Some(base) = preset(name) else {
            return Err(MapError::NoPreset { path: path.into(), preset: name.into() });
        };
        let mut whole: toml::Table = toml::from_str(base).map_err(unreadable)?;
        whole.extend(given);
        whole.try_into().map_err(unreadable)
    }

    /// Whether it can be followed.
    fn check(&self) -> Result<(), String> {
        for names in self.state.values() {
            state_columns(names)?;
        }
        self.check_action()?;
        let wrong = |size: &[u32; 2]| !size.iter().all(|side| (1..=LONGEST_SIDE_PX).contains(side));
        if let Some((key, _)) = self.images.iter().find(|(_, image)| image.size.as_ref().is_some_and(wrong)) {
            return Err(format!("the size of {key:?}: give two numbers from 1 to {LONGEST_SIDE_PX}"));
        }
        for (name, count) in [("rows", self.chunk.rows), ("execute", self.chunk.execute)] {
            if count == Some(0) {
                return Err(format!("[chunk] {name} is 0; a chunk has at least one row"));
            }
        }
        for (name, value_s) in [("connect_s", self.connect_s), ("reply_s", self.reply_s)] {
            if !(0.0..=86400.0).contains(&value_s) {
                return Err(format!("{name} is {value_s}; give seconds, at most a day's"));
            }
        }
        self.check_keys()
    }

    /// No column may be told by two keys.
    fn check_action(&self) -> Result<(), String> {
        let all: Vec<String> = self.action.values().flatten().cloned().collect();
        match action_columns(&all)?.is_empty() {
            true => Err("[action] tells no column".into()),
            false => Ok(()),
        }
    }

    /// One answer for all robots is asked with keys for all robots.
    fn check_keys(&self) -> Result<(), String> {
        if self.answer == AnswerScope::One {
            return Ok(());
        }
        let egocentric = self.images.iter().filter(|(_, image)| image.camera == CameraName::Egocentric);
        let mut own = egocentric.map(|(key, _)| key).chain(self.state.keys());
        match (self.scope, own.find(|key| !key.contains(ROBOT))) {
            (Scope::Local, _) => Err("answer = \"all\" needs scope = \"global\"".into()),
            (Scope::Global, Some(key)) => Err(format!(
                "answer = \"all\" asks for no robot in particular; put {ROBOT} into the key {key:?}"
            )),
            (Scope::Global, None) => Ok(()),
        }
    }

    /// What a policy is shown beyond what robots see and feel.
    pub fn extra_information(&self) -> Vec<String> {
        match self.shows_third_person() {
            true => vec!["third_person".into()],
            false => Vec::new(),
        }
    }

    /// Whether the camera that sees all robots is shown.
    pub fn shows_third_person(&self) -> bool {
        self.images.values().any(|image| image.camera == CameraName::ThirdPerson)
    }
}

fn preset(name: &str) -> Option<&'static str> {
    PRESETS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<PolicyMap, MapError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), text).unwrap();
        PolicyMap::find(&file.path().display().to_string())
    }

    #[test]
    fn presets_can_be_followed_and_changed() {
        for (name, _) in PRESETS {
            let map = PolicyMap::find(name).unwrap();
            let told: usize = map.action.values().map(|names| action_columns(names).unwrap().len()).sum();
            assert_eq!((told, map.extra_information()), (35, Vec::new()), "{name}");
        }
        let own =
            "preset = \"openpi\"\nreply_s = 5\n[chunk]\nexecute = 25\n[state]\n\"state\" = [\"left_arm\"]\n";
        let changed = read(own).unwrap();
        let preset = PolicyMap::find("openpi").unwrap();
        let state = BTreeMap::from([("state".to_owned(), vec!["left_arm".to_owned()])]);
        let chunk = Chunk { rows: None, execute: Some(25) };
        assert_eq!(changed, PolicyMap { reply_s: 5.0, chunk, state, ..preset });
    }

    #[test]
    fn what_is_wrong_with_a_map_is_said() {
        let check = |text: &str, says: &str| {
            let told = read(&format!("preset = \"openpi\"\n{text}")).unwrap_err().to_string();
            assert!(told.contains(says), "{told}");
        };
        check("[state]\n\"s\" = [\"left_foot\"]", "no column \"left_foot\"; have: left_leg");
        check(
            "[action]\n\"a\" = [\"waist\"]\n\"b\" = [\"waist_yaw_joint\"]",
            "\"waist_yaw_joint\" is told twice",
        );
        check("[action]", "tells no column");
        check("[chunk]\nrows = 0", "rows is 0");
        check("reply_s = nan", "reply_s is NaN");
        check("answer = \"all\"", "needs scope = \"global\"");
        check("answer = \"all\"\nscope = \"global\"", "put {robot} into the key \"observation/image\"");
        check("scop = \"global\"", "unknown field `scop`");
        check("[images]\n\"i\" = { camera = \"egocentric\", size = [0, 9] }", "from 1 to 4096");
        assert!(read("preset = \"opempi\"").unwrap_err().to_string().contains("have: openpi, gr00t_n17_g1"));
        let text = PolicyMap::find("opempi").unwrap_err().to_string();
        assert!(
            text.starts_with("no policy map \"opempi\"") && text.contains("openpi, gr00t_n17_g1"),
            "{text}"
        );
    }
}
