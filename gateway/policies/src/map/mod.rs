//! Policy maps: the values and images that a policy gets, those that it returns, and their keys. A map is a
//! small TOML file or a preset.

mod check;

use std::{
    collections::BTreeMap,
    io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use tandem_episodes::{CONTROL_HZ, MAX_TEXT_BYTES, read_text};
use tandem_tools_spec::{ACTION_ROW_LEN, ExtraInformation};

use crate::{
    columns::{WRISTS, extra_columns, motors, wrists},
    named_columns::{CommandRow, NamedColumns, StateRow, joined},
};

/// Built-in maps by name. Each file states and explains all entries.
pub const PRESETS: [(&str, &str); 3] = [
    ("openpi", include_str!("presets/openpi.toml")),
    ("xpolicylab", include_str!("presets/xpolicylab.toml")),
    ("gr00t_n17_g1", include_str!("presets/gr00t_n17_g1.toml")),
];

/// Placeholder for a robot's name in a key.
pub const ROBOT: &str = "{robot}";

/// Inputs and outputs of a policy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolicyMap {
    pub scope: Scope,
    pub answer: AnswerScope,
    pub instruction: Words,
    /// Number of leading axes of length 1 on images and states.
    pub leading_axes: usize,
    /// Time limit for connecting to a server, in seconds.
    pub connect_s: f64,
    /// Time limit for an answer, in seconds. The first answer of an episode may take longer.
    pub reply_s: f64,
    pub images: BTreeMap<String, ImageKey>,
    pub state: BTreeMap<String, Vec<NamedColumns<StateRow>>>,
    pub prompt: BTreeMap<String, PromptForm>,
    pub action: BTreeMap<String, Vec<NamedColumns<CommandRow>>>,
    pub chunk: Chunk,
    /// History of observations; `None` if a policy only gets the present one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub history: Option<HistorySpan>,
}

/// Robots whose images and joints a request contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    /// Only the robot of the request.
    Local,
    /// All robots, under keys that contain their names.
    Global,
}

/// Robots that an answer commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AnswerScope {
    /// The robot of the request.
    One,
    /// All robots.
    All,
}

/// Instruction that a request contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Words {
    /// The robot's part of the task.
    Robot,
    /// The task of all robots together.
    Joint,
}

/// Source and format of an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageKey {
    pub camera: CameraName,
    /// Width and height in pixels; `None` for the camera's size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    #[serde(default)]
    pub fit: Fit,
    #[serde(default)]
    pub layout: Layout,
}

/// Camera of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraName {
    Egocentric,
    /// A view that the robots themselves do not have.
    ThirdPerson,
}

/// Encoding of the instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PromptForm {
    Text,
    List,
}

/// Method of resizing an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// Scales the whole image to the largest size that fits, centred on black, like `resize_with_pad` of
    /// openpi-client.
    #[default]
    Pad,
    /// Stretches the image to the new size and ignores the aspect ratio.
    Stretch,
    /// Uses the largest centred part with the right aspect ratio.
    Crop,
}

/// Order of an image's axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// Rows, columns, colours.
    #[default]
    Hwc,
    /// Colours, rows, columns.
    Chw,
}

/// Interpretation and execution of the rows of an answer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chunk {
    /// Required number of rows in an answer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<usize>,
    /// Number of rows to execute, from the first row on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub execute: Option<usize>,
    /// Rows per second; `None` for one row per control step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    #[serde(default, skip_serializing_if = "is_default")]
    pub between: Between,
    /// Columns that are differences from the state at the time of the request.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub delta: Vec<NamedColumns<CommandRow>>,
    #[serde(default, skip_serializing_if = "is_default")]
    pub wrist_frame: WristFrame,
}

/// Commands in the control steps that one row spans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Between {
    /// Linear interpolation from the previous row to this one. Velocities change immediately.
    #[default]
    Interpolate,
    /// The values of this row in every control step.
    Hold,
}

/// Frame of wrist poses in an answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WristFrame {
    /// The pelvis frame. Hands move with the pelvis.
    #[default]
    Pelvis,
    /// The robot's pose at the episode's start, by its own odometry. Hands stay fixed in the world.
    Start,
    /// The observed wrist frame itself. Poses in it are always differences. Hands stay fixed in the world.
    Wrist,
}

/// Extent of the history that a request contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HistorySpan {
    /// Number of observations, including the present one.
    pub length: usize,
    /// Number of rows executed between two requests.
    #[serde(default = "one")]
    pub stride: usize,
    #[serde(default)]
    pub form: HistoryForm,
}

/// Combination of observations from several times, oldest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HistoryForm {
    /// Arrays with an axis for time, after the leading axes.
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

/// Columns of an answer that are differences from the observed state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeltaColumns {
    /// Columns of an action row.
    pub row_columns: Vec<usize>,
    /// True for the left and the right wrist if its pose is a difference.
    pub wrists: [bool; 2],
}

/// Reason why a map cannot be used.
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
    /// Returns the preset called `name`, or reads the map from the file with that name.
    ///
    /// A file may begin with `preset = "NAME"`. Its entries then replace entries of the preset; tables are
    /// replaced as a whole.
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

    /// Returns the number of rows per second in an answer.
    pub fn rate_hz(&self) -> f64 {
        self.chunk.rate_hz.unwrap_or(CONTROL_HZ)
    }

    /// Returns the columns of an answer that are differences from the observed state.
    pub fn delta(&self) -> DeltaColumns {
        let delta = &self.chunk.delta;
        let of_row = joined(delta).into_iter().filter(|column| *column < ACTION_ROW_LEN);
        DeltaColumns {
            row_columns: of_row.collect(),
            wrists: WRISTS.map(|wrist| delta.iter().any(|named| named.name == wrist)),
        }
    }

    /// Returns the robot indices of each request in a task with `robots` robots.
    pub fn queries(&self, robots: usize) -> Vec<Vec<usize>> {
        match self.answer {
            AnswerScope::One => (0..robots).map(|robot| vec![robot]).collect(),
            AnswerScope::All => vec![(0..robots).collect()],
        }
    }

    /// Returns true if the policy commands wrist poses.
    pub fn moves_wrists(&self) -> bool {
        self.told_columns().iter().any(|column| wrists().contains(column))
    }

    /// Returns true if the policy commands motor setpoints.
    pub fn drives_motors(&self) -> bool {
        self.told_columns().iter().any(|column| motors().contains(column))
    }

    /// Returns the columns that an answer contains, in no particular order.
    pub fn told_columns(&self) -> Vec<usize> {
        self.action.values().flat_map(|names| joined(names)).collect()
    }

    /// Returns the extra information that the policy gets and the benchmark withholds from its own policies.
    pub fn shown(&self) -> Vec<ExtraInformation> {
        let columns: Vec<usize> = self.state.values().flat_map(|names| joined(names)).collect();
        let mut shown = extra_columns(&columns);
        // A policy that outputs poses in the start frame needs the robot's pose in that frame.
        if self.chunk.wrist_frame == WristFrame::Start && !shown.contains(&ExtraInformation::Odometry) {
            shown.push(ExtraInformation::Odometry);
        }
        shown.extend(self.shows_third_person().then_some(ExtraInformation::ThirdPerson));
        shown.sort();
        shown
    }

    /// Returns the names of [`PolicyMap::shown`], and of other episode data that the benchmark withholds from
    /// its own policies.
    pub fn extra_information(&self) -> Vec<String> {
        let of_moment = [("episode", "episode number"), ("step", "clock")];
        let is_named = |column: &str| self.state.values().flatten().any(|named| named.name == column);
        let of_moment = of_moment.into_iter().filter(|(column, _)| is_named(column));
        let shown = self.shown().into_iter().map(|what| what.name().to_owned());
        shown.chain(of_moment.map(|(_, what)| what.to_owned())).collect()
    }

    /// Returns true if the policy gets the third-person image.
    pub fn shows_third_person(&self) -> bool {
        self.images.values().any(|image| image.camera == CameraName::ThirdPerson)
    }
}

/// Returns the text of the preset called `name`.
pub fn preset(name: &str) -> Option<&'static str> {
    PRESETS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads the map from a file that contains `text`.
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
            let told = map.told_columns().len();
            // XPolicyLab has no keys for waist and base.
            let all = if name == "xpolicylab" { 28 } else { 35 };
            assert_eq!((told, map.extra_information()), (all, Vec::new()), "{name}");
        }
        let own =
            "preset = \"openpi\"\nreply_s = 5\n[chunk]\nexecute = 25\n[state]\n\"state\" = [\"left_arm\"]\n";
        let changed = read(own).unwrap();
        let preset = PolicyMap::find("openpi").unwrap();
        let left_arm = NamedColumns::try_from("left_arm".to_owned()).unwrap();
        let state = BTreeMap::from([("state".to_owned(), vec![left_arm])]);
        let chunk = Chunk { execute: Some(25), ..Chunk::default() };
        assert_eq!(changed, PolicyMap { reply_s: 5.0, chunk, state, ..preset });
    }
}
