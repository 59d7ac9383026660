//! What may be laid over an episode to see what is left of a policy when things go wrong: one axis a file. Each is a function of seed and
//! level alone, laid over the same episode that the plain run plays, so that both can be compared seed by seed. What a robot or an object
//! feels of it is a force or a property that a world could have.
//!
//! To add an axis: one file here, its name in [`StressAxis`], and where it acts.

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

/// What goes wrong.
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

/// How much of it: 1, 2 or 3.
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

    /// The value of this level.
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

/// What is laid over an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Stress {
    pub axis: StressAxis,
    pub level: StressLevel,
}

/// As results and folders have it: `camera-2`.
impl fmt::Display for Stress {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}-{}", self.axis.name(), self.level.number())
    }
}

impl Stress {
    /// The level, if this is the axis.
    fn on(self, axis: StressAxis) -> Option<StressLevel> {
        (self.axis == axis).then_some(self.level)
    }

    /// How far the seed moves things, at least as far as it does without.
    pub fn spread(self, plain: Spread) -> Spread {
        self.on(StressAxis::Layout).map_or(plain, |level| plain.max(layout::spread(level)))
    }

    /// What robots sense, in place of what they sense without.
    pub fn sensing(self, plain: Sensing) -> Sensing {
        let on = self.on(StressAxis::Sensors);
        on.map_or(plain, |level| Sensing { sensors: sensors::model(level), ..plain })
    }

    /// How many things stand about that the task has no use for.
    pub fn distractors(self) -> usize {
        self.on(StressAxis::Layout).map_or(0, layout::count)
    }

    /// Changes what a world of `task` is made of, before its first step. Its policy takes over after `hold_steps`.
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

    /// Which robot keeps what it has to say to itself, if one does.
    pub fn silence(self, seed: u32, robots: usize) -> Option<Silence> {
        self.on(StressAxis::Partner).and_then(|level| Silence::of(level, seed, robots))
    }

    /// What of the axis a seed has, as "drops what it holds", where seeds take turns.
    pub fn kind(self, seed: u32) -> Option<&'static str> {
        self.on(StressAxis::Partner).map(|_| partner::kind(seed))
    }
}

/// What there is to draw of a world.
pub fn scenery(stress: Option<Stress>, seed: u32, world: &World) -> Scenery {
    let mut scenery = Scenery::of(world);
    match stress {
        Some(Stress { axis: StressAxis::Light, level }) => scenery.light = light::light(level, seed),
        Some(Stress { axis: StressAxis::Texture, level }) => texture::repaint(&mut scenery, level, seed),
        _ => {}
    }
    scenery
}

/// The cameras of a world.
pub fn cameras(stress: Option<Stress>, seed: u32, world: &World) -> Cameras {
    let mut cameras = Cameras::of(world);
    if let Some(level) = stress.and_then(|stress| stress.on(StressAxis::Camera)) {
        for robot in 0..world.robots().len() {
            cameras.set_lens(robot, camera::lens(level, seed, robot));
        }
    }
    cameras
}

/// The words in which the policies of an episode are told its task.
pub fn task_words(stress: Option<Stress>, task: &'static Task) -> TaskWords {
    let reworded =
        stress.and_then(|stress| stress.on(StressAxis::Words)).and_then(|level| reworded(task, level));
    reworded.unwrap_or_else(|| TaskWords::of(task))
}

/// Whether an episode of `task` can be laid under `stress`: a task has other words only where its file gives some.
pub fn is_possible(stress: Option<Stress>, task: &'static Task) -> bool {
    let words = stress.and_then(|stress| stress.on(StressAxis::Words));
    words.is_none_or(|level| reworded(task, level).is_some())
}

/// Numbers that belong to an axis under a seed; `part` tells robots, objects or times apart. Levels share them, so that a higher one is
/// the same farther.
fn random(axis: StressAxis, seed: u32, part: usize) -> SplitMix64 {
    const STREAM: u64 = 0x7374_7265_7373_0000;
    SplitMix64(STREAM ^ (u64::from(seed) | (axis as u64 + 1) << 32 | (part as u64 + 1) << 40))
}
