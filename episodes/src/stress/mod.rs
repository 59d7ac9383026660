//! Stress on episodes, to measure the robustness of policies: one axis per file. Each stress is a function of
//! seed and level alone, applied to the episode of the plain run. Stressed and plain runs can therefore be
//! compared seed by seed. The effects on robots and objects are forces or properties that a real world could
//! have.
//!
//! To add an axis: one file here, its name in [`StressAxis`], and the place where it acts.

mod camera;
mod execution;
mod friction;
mod latency;
mod layout;
mod light;
mod mass;
mod partner;
mod push;
mod sensors;
mod texture;
mod words;

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use tandem_sim::render::{Cameras, Scenery};
use tandem_sim::{Sensing, SplitMix64, World};

use crate::tasks::{Spread, Task, TaskWords};

pub use execution::{Execution, ExecutionMemory};
pub use layout::distractors;
pub use partner::Silence;
pub use words::{reworded, reworded_tasks};

/// The kind of stress.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StressAxis {
    Camera,
    Light,
    Texture,
    Layout,
    Mass,
    Friction,
    Sensors,
    Latency,
    Push,
    Words,
    Partner,
}

impl StressAxis {
    pub const ALL: [StressAxis; 11] = [
        StressAxis::Camera,
        StressAxis::Light,
        StressAxis::Texture,
        StressAxis::Layout,
        StressAxis::Mass,
        StressAxis::Friction,
        StressAxis::Sensors,
        StressAxis::Latency,
        StressAxis::Push,
        StressAxis::Words,
        StressAxis::Partner,
    ];

    pub fn name(self) -> &'static str {
        match self {
            StressAxis::Camera => "camera",
            StressAxis::Light => "light",
            StressAxis::Texture => "texture",
            StressAxis::Layout => "layout",
            StressAxis::Mass => "mass",
            StressAxis::Friction => "friction",
            StressAxis::Sensors => "sensors",
            StressAxis::Latency => "latency",
            StressAxis::Push => "push",
            StressAxis::Words => "words",
            StressAxis::Partner => "partner",
        }
    }
}

/// The level of stress: 1, 2 or 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub enum StressLevel {
    One,
    Two,
    Three,
}

impl StressLevel {
    pub const ALL: [StressLevel; 3] = [StressLevel::One, StressLevel::Two, StressLevel::Three];

    pub fn number(self) -> u8 {
        match self {
            StressLevel::One => 1,
            StressLevel::Two => 2,
            StressLevel::Three => 3,
        }
    }

    /// Returns the value of this level.
    fn of<T>(self, [one, two, three]: [T; 3]) -> T {
        match self {
            StressLevel::One => one,
            StressLevel::Two => two,
            StressLevel::Three => three,
        }
    }
}

impl From<StressLevel> for u8 {
    fn from(level: StressLevel) -> u8 {
        level.number()
    }
}

impl TryFrom<u8> for StressLevel {
    type Error = String;

    fn try_from(number: u8) -> Result<StressLevel, String> {
        let found = StressLevel::ALL.into_iter().find(|level| level.number() == number);
        found.ok_or_else(|| format!("no level {number} of stress; have: 1, 2, 3"))
    }
}

impl FromStr for StressLevel {
    type Err = String;

    fn from_str(text: &str) -> Result<StressLevel, String> {
        let number: Option<u8> = text.trim().parse().ok();
        number
            .ok_or_else(|| format!("no level {text:?} of stress; have: 1, 2, 3"))
            .and_then(StressLevel::try_from)
    }
}

/// The stress on an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Stress {
    pub axis: StressAxis,
    pub level: StressLevel,
}

/// Formats the stress as in results and folders: `camera-2`.
impl fmt::Display for Stress {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}-{}", self.axis.name(), self.level.number())
    }
}

impl Stress {
    /// Returns the level, if this is the axis.
    fn on(self, axis: StressAxis) -> Option<StressLevel> {
        (self.axis == axis).then_some(self.level)
    }

    /// Returns the spread of the objects, at least that of the plain run.
    pub fn spread(self, plain: Spread) -> Spread {
        self.on(StressAxis::Layout).map_or(plain, |level| plain.max(layout::spread(level)))
    }

    /// Returns the sensing under stress, which replaces the plain one.
    pub fn sensing(self, plain: Sensing) -> Sensing {
        let on = self.on(StressAxis::Sensors);
        on.map_or(plain, |level| Sensing { sensors: sensors::model(level), ..plain })
    }

    /// Returns the number of distractors.
    pub fn distractors(self) -> usize {
        self.on(StressAxis::Layout).map_or(0, layout::count)
    }

    /// Changes the physical properties of a world of `task` before its first step. The policy takes over
    /// after `hold_steps`.
    pub fn alter(self, world: &mut World, task: &Task, seed: u32, hold_steps: u32) {
        match self.axis {
            StressAxis::Mass => mass::alter(world, task, self.level, seed),
            StressAxis::Friction => friction::alter(world, task, self.level),
            StressAxis::Push => {
                world.plan_pushes(push::plan(self.level, seed, task.robots.len(), hold_steps))
            }
            StressAxis::Camera
            | StressAxis::Light
            | StressAxis::Texture
            | StressAxis::Layout
            | StressAxis::Sensors
            | StressAxis::Latency
            | StressAxis::Words
            | StressAxis::Partner => {}
        }
    }

    /// Returns the robot whose messages are suppressed; `None` if there is none.
    pub fn silence(self, seed: u32, robots: usize) -> Option<Silence> {
        self.on(StressAxis::Partner).and_then(|level| Silence::of(level, seed, robots))
    }

    /// Returns the variant of the axis that a seed has, for example "drops what it holds"; `None` for axes
    /// without variants.
    pub fn kind(self, seed: u32) -> Option<&'static str> {
        self.on(StressAxis::Partner).map(|_| partner::kind(seed))
    }
}

/// Returns the scenery of a world for rendering.
pub fn scenery(stress: Option<Stress>, seed: u32, world: &World) -> Scenery {
    let mut scenery = Scenery::of(world);
    match stress {
        Some(Stress { axis: StressAxis::Light, level }) => light::relight(&mut scenery, level, seed),
        Some(Stress { axis: StressAxis::Texture, level }) => texture::repaint(&mut scenery, level, seed),
        _ => {}
    }
    scenery
}

/// Returns the cameras of a world.
pub fn cameras(stress: Option<Stress>, seed: u32, world: &World) -> Cameras {
    let mut cameras = Cameras::of(world);
    if let Some(level) = stress.and_then(|stress| stress.on(StressAxis::Camera)) {
        for robot in 0..world.robots().len() {
            cameras.set_lens(robot, camera::lens(level, seed, robot));
        }
    }
    cameras
}

/// Returns the instructions that the policies of an episode receive.
pub fn task_words(stress: Option<Stress>, task: &Task) -> TaskWords {
    let reworded =
        stress.and_then(|stress| stress.on(StressAxis::Words)).and_then(|level| reworded(task, level));
    reworded.unwrap_or_else(|| TaskWords::of(task))
}

/// Returns `true` if `stress` can be applied to `task`. Reworded instructions exist only for some tasks.
pub fn is_possible(stress: Option<Stress>, task: &Task) -> bool {
    let words = stress.and_then(|stress| stress.on(StressAxis::Words));
    words.is_none_or(|level| reworded(task, level).is_some())
}

/// Returns a random stream of an axis under a seed; `part` separates robots, objects or times. Levels share
/// the stream, so that a higher level is the same effect, but stronger.
fn random(axis: StressAxis, seed: u32, part: usize) -> SplitMix64 {
    const STREAM: u64 = 0x7374_7265_7373_0000;
    SplitMix64(STREAM ^ (u64::from(seed) | (axis as u64 + 1) << 32 | (part as u64 + 1) << 40))
}
