//! Which numbers and pictures go under which key to a policy, and which come back: a small TOML file, or a preset.

mod check;

use std::{
    collections::BTreeMap,
    io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use tandem_episodes::{CONTROL_HZ, MAX_TEXT_BYTES, read_text};
use tandem_tools_spec::{ACTION_ROW_LEN, ExtraInformation};

use super::columns::{WRISTS, action_columns, extra_columns, state_columns};

/// Maps that the program carries, by name; each is written out and explained in its file.
pub const PRESETS: [(&str, &str); 3] = [
    ("openpi", include_str!("presets/openpi.toml")),
    ("xpolicylab", include_str!("presets/xpolicylab.toml")),
    ("gr00t_n17_g1", include_str!("presets/gr00t_n17_g1.toml")),
];

/// What stands for a robot's name in a key.
pub const ROBOT: &str = "{robot}";

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
    /// Left out where a policy is shown the present alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub history: Option<HistorySpan>,
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

/// How a picture gets to another size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// The whole picture as large as fits, in the middle of black, as `resize_with_pad` of openpi-client.
    #[default]
    Pad,
    /// Stretched to the new size, whatever becomes of its shape.
    Stretch,
    /// The largest part of the right shape, from the middle.
    Crop,
}

/// The order of a picture's elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// Rows, columns, colours.
    #[default]
    Hwc,
    /// Colours, rows, columns.
    Chw,
}

/// How the rows of an answer are understood and executed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chunk {
    /// How many there have to be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<usize>,
    /// How many of them are executed, from the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub execute: Option<usize>,
    /// How many make a second; left out: one a control step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    #[serde(default, skip_serializing_if = "is_default")]
    pub between: Between,
    /// Columns that are differences to what was observed when the policy was asked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub delta: Vec<String>,
    #[serde(default, skip_serializing_if = "is_default")]
    pub wrist_frame: WristFrame,
}

/// What robots are told in the control steps that one row lasts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Between {
    /// To go evenly from the row before to this one. Velocities change at once.
    #[default]
    Interpolate,
    /// This row in every one of them.
    Hold,
}

/// In whose axes poses of wrists are told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WristFrame {
    /// The pelvis: hands go where it goes.
    #[default]
    Pelvis,
    /// Where the robot stood at the episode's start, by its own odometry: hands stay in the world.
    Start,
    /// The wrist itself as it was observed; such poses are always differences. Hands stay in the world.
    Wrist,
}

/// How much of the past a policy is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HistorySpan {
    /// How many observations, the present one included.
    pub length: usize,
    /// How many rows are executed between two of them.
    #[serde(default = "one")]
    pub stride: usize,
    #[serde(default)]
    pub form: HistoryForm,
}

/// How observations of several moments are put together, the oldest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HistoryForm {
    /// Arrays with an axis of moments, behind the leading axes.
    #[default]
    Stack,
    /// Lists of arrays.
    List,
}

fn one() -> usize {
    1
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// What of an answer is a difference to what was observed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeltaColumns {
    /// Columns of an action row.
    pub row_columns: Vec<usize>,
    /// The left and the right wrist.
    pub wrists: [bool; 2],
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
            None => read_text(path, MAX_TEXT_BYTES)
                .map_err(|source| MapError::Read { name: name.into(), source })?,
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

    /// How many rows of an answer make a second.
    pub fn rate_hz(&self) -> f64 {
        self.chunk.rate_hz.unwrap_or(CONTROL_HZ)
    }

    /// What of an answer is a difference. The map was checked when it was read.
    pub fn delta(&self) -> DeltaColumns {
        let is_wrist = |name: &&String| WRISTS.contains(&name.as_str());
        let (wrists, others): (Vec<&String>, Vec<&String>) = self.chunk.delta.iter().partition(is_wrist);
        let others: Vec<String> = others.into_iter().cloned().collect();
        DeltaColumns {
            row_columns: action_columns(&others).unwrap_or_default(),
            wrists: WRISTS.map(|wrist| wrists.iter().any(|name| *name == wrist)),
        }
    }

    /// The robots of each request, where there are `robots`.
    pub fn queries(&self, robots: usize) -> Vec<Vec<usize>> {
        match self.answer {
            AnswerScope::One => (0..robots).map(|robot| vec![robot]).collect(),
            AnswerScope::All => vec![(0..robots).collect()],
        }
    }

    /// Whether robots are told where their wrists are to be.
    pub fn moves_wrists(&self) -> bool {
        self.told_columns().iter().any(|column| *column >= ACTION_ROW_LEN)
    }

    /// The columns that an answer tells, in no order.
    pub fn told_columns(&self) -> Vec<usize> {
        let all: Vec<String> = self.action.values().flatten().cloned().collect();
        action_columns(&all).unwrap_or_default()
    }

    /// What a policy is shown that the benchmark's own policies are not. The map was checked when it was read.
    pub fn shown(&self) -> Vec<ExtraInformation> {
        let names: Vec<String> = self.state.values().flatten().cloned().collect();
        let mut shown = extra_columns(&state_columns(&names).unwrap_or_default());
        // Whoever tells poses in the start frame has to know where the robot is in it.
        if self.chunk.wrist_frame == WristFrame::Start && !shown.contains(&ExtraInformation::Odometry) {
            shown.push(ExtraInformation::Odometry);
        }
        shown.extend(self.shows_third_person().then_some(ExtraInformation::ThirdPerson));
        shown.sort();
        shown
    }

    /// As [`PolicyMap::shown`], by name, and what else a policy is told of its episode that the benchmark's are not.
    pub fn extra_information(&self) -> Vec<String> {
        let of_moment = [("episode", "episode number"), ("step", "clock")];
        let is_named = |column: &str| self.state.values().flatten().any(|name| name == column);
        let of_moment = of_moment.into_iter().filter(|(column, _)| is_named(column));
        let shown = self.shown().into_iter().map(|what| what.name().to_owned());
        shown.chain(of_moment.map(|(_, what)| what.to_owned())).collect()
    }

    /// Whether the camera that sees all robots is shown.
    pub fn shows_third_person(&self) -> bool {
        self.images.values().any(|image| image.camera == CameraName::ThirdPerson)
    }
}

/// The file of the preset called `name`.
pub fn preset(name: &str) -> Option<&'static str> {
    PRESETS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The map of a file that holds this.
    pub(super) fn read(text: &str) -> Result<PolicyMap, MapError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        PolicyMap::find(&file.path().display().to_string())
    }

    #[test]
    fn a_clock_and_the_number_of_an_episode_are_named() {
        let map =
            read("preset = \"openpi\"\n[state]\n\"s\" = [\"left_arm\", \"step\", \"episode\", \"reset\"]\n")
                .unwrap();
        assert_eq!(
            (map.extra_information(), map.shown()),
            (vec!["episode number".into(), "clock".into()], vec![])
        );
    }

    #[test]
    fn presets_can_be_followed_and_changed() {
        for (name, _) in PRESETS {
            let map = PolicyMap::find(name).unwrap();
            let told: usize = map.action.values().map(|names| action_columns(names).unwrap().len()).sum();
            // XPolicyLab has no words for waist and base.
            let all = if name == "xpolicylab" { 28 } else { 35 };
            assert_eq!((told, map.extra_information()), (all, Vec::new()), "{name}");
        }
        let own =
            "preset = \"openpi\"\nreply_s = 5\n[chunk]\nexecute = 25\n[state]\n\"state\" = [\"left_arm\"]\n";
        let changed = read(own).unwrap();
        let preset = PolicyMap::find("openpi").unwrap();
        let state = BTreeMap::from([("state".to_owned(), vec!["left_arm".to_owned()])]);
        let chunk = Chunk { execute: Some(25), ..Chunk::default() };
        assert_eq!(changed, PolicyMap { reply_s: 5.0, chunk, state, ..preset });
    }
}
