//! The rules of an episode, the information for policies, and the status of an episode.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::driving::Operators;
use super::frames::PoseFrame;

/// Rules of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Protocol {
    /// For agents that think between commands: at most 25 steps a command.
    Agentic,
    /// For learned policies: at most 50 steps a command.
    Benchmark,
}

impl Protocol {
    /// Every protocol.
    pub const ALL: [Protocol; 2] = [Protocol::Agentic, Protocol::Benchmark];

    /// Returns the name that JSON, command lines and reports use.
    pub fn name(self) -> &'static str {
        match self {
            Protocol::Agentic => "agentic",
            Protocol::Benchmark => "benchmark",
        }
    }
}

impl fmt::Display for Protocol {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.pad(self.name())
    }
}

/// Amount of information that a policy gets.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Assistance {
    /// The benchmark's: images, joint angles, wrist poses, calibration, depth at pixels, distances of wrists
    /// from their targets, joints at a limit, and the budget; success at the end of the episode.
    Paper,
    /// All that a robot could sense, states of hands, falls, phases as they are reached, their conditions,
    /// and how to grasp.
    #[default]
    Full,
}

impl Assistance {
    /// Both levels.
    pub const ALL: [Assistance; 2] = [Assistance::Paper, Assistance::Full];

    /// Returns the name that JSON, command lines and reports use.
    pub fn name(self) -> &'static str {
        match self {
            Assistance::Paper => "paper",
            Assistance::Full => "full",
        }
    }

    /// Describes the assistance with `disclosure` and `hints`, for the log at a program's start.
    pub fn about(self, disclosure: Disclosure, hints: Hints) -> String {
        let sensed = match self {
            Assistance::Paper => "what the benchmark tells its agents",
            Assistance::Full => "all that robots sense",
        };
        let success = match disclosure {
            Disclosure::Live => "phases as they are reached",
            Disclosure::End => "success at the end of the episode",
            Disclosure::Never => "nothing of their success",
        };
        let grasps = match hints {
            Hints::On => ", and how to grasp",
            Hints::Off => "",
        };
        format!("assistance {self}: policies are told {sensed}, {success}{grasps}")
    }

    /// Returns the disclosure of phases at this level.
    pub fn disclosure(self) -> Disclosure {
        match self {
            Assistance::Paper => Disclosure::End,
            Assistance::Full => Disclosure::Live,
        }
    }

    /// Returns the hints at this level.
    pub fn hints(self) -> Hints {
        match self {
            Assistance::Paper => Hints::Off,
            Assistance::Full => Hints::On,
        }
    }
}

impl fmt::Display for Assistance {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.pad(self.name())
    }
}

/// Variant of the texts about tools that a policy reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wording {
    /// Level of assistance; `full` adds texts on extra information.
    pub assistance: Assistance,
    /// Hints on grasping.
    pub hints: Hints,
    /// Operator of one robot, or one policy for all robots.
    pub operators: Operators,
}

impl Wording {
    /// Returns the variant for the operator of one robot.
    pub fn for_operator(self) -> Wording {
        Wording { operators: Operators::PerRobot, ..self }
    }
}

impl From<Assistance> for Wording {
    fn from(assistance: Assistance) -> Wording {
        Wording { assistance, hints: assistance.hints(), operators: Operators::One }
    }
}

impl From<Hints> for Wording {
    fn from(hints: Hints) -> Wording {
        Wording { assistance: Assistance::Full, hints, operators: Operators::One }
    }
}

/// Information that a policy may get and the benchmark withholds from its own policies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExtraInformation {
    /// Depth at every pixel of an image.
    DepthImages,
    /// Depth at single pixels. It is extra only under the protocol for learned policies.
    PixelDepth,
    /// The camera that sees all robots.
    ThirdPerson,
    /// Joint velocities.
    JointVelocities,
    /// Torques of joint drives.
    JointTorques,
    /// External forces on hands.
    HandForces,
    /// Odometry.
    Odometry,
    /// Direction of gravity.
    Gravity,
    /// Angular velocity and specific force of the pelvis.
    InertialReadings,
    /// Unmet conditions of the next phase, and poses of held objects, as the simulator measures them.
    PhaseConditions,
    /// Pixels of an object selected by name, from the simulator's ground truth.
    ObjectPixels,
}

impl ExtraInformation {
    /// All kinds.
    pub const ALL: [ExtraInformation; 11] = [
        ExtraInformation::DepthImages,
        ExtraInformation::PixelDepth,
        ExtraInformation::ThirdPerson,
        ExtraInformation::JointVelocities,
        ExtraInformation::JointTorques,
        ExtraInformation::HandForces,
        ExtraInformation::Odometry,
        ExtraInformation::Gravity,
        ExtraInformation::InertialReadings,
        ExtraInformation::PhaseConditions,
        ExtraInformation::ObjectPixels,
    ];

    /// Returns the name in results and reports.
    pub fn name(self) -> &'static str {
        match self {
            ExtraInformation::DepthImages => "depth_images",
            ExtraInformation::PixelDepth => "pixel_depth",
            ExtraInformation::ThirdPerson => "third_person",
            ExtraInformation::JointVelocities => "joint_velocities",
            ExtraInformation::JointTorques => "joint_torques",
            ExtraInformation::HandForces => "hand_forces",
            ExtraInformation::Odometry => "odometry",
            ExtraInformation::Gravity => "gravity",
            ExtraInformation::InertialReadings => "inertial_readings",
            ExtraInformation::PhaseConditions => "phase_conditions",
            ExtraInformation::ObjectPixels => "object_pixels",
        }
    }

    /// Returns true if `full` assistance includes this information, so that naming the assistance implies it.
    pub fn is_of_full_assistance(self) -> bool {
        match self {
            ExtraInformation::DepthImages
            | ExtraInformation::PixelDepth
            | ExtraInformation::ThirdPerson
            | ExtraInformation::PhaseConditions
            | ExtraInformation::ObjectPixels => false,
            ExtraInformation::JointVelocities
            | ExtraInformation::JointTorques
            | ExtraInformation::HandForces
            | ExtraInformation::Odometry
            | ExtraInformation::Gravity
            | ExtraInformation::InertialReadings => true,
        }
    }
}

/// Disclosure of phases in replies, and whether success ends an episode.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Disclosure {
    /// Every reply lists the phases reached, and the last phase ends the episode.
    #[default]
    Live,
    /// Phases are disclosed after the episode, which success does not end: call finish.
    End,
    /// Phases are never disclosed, nor does success end the episode: call finish.
    Never,
}

impl Disclosure {
    /// All kinds.
    pub const ALL: [Disclosure; 3] = [Disclosure::Live, Disclosure::End, Disclosure::Never];

    /// Returns the name that JSON, command lines and reports use.
    pub fn name(self) -> &'static str {
        match self {
            Disclosure::Live => "live",
            Disclosure::End => "end",
            Disclosure::Never => "never",
        }
    }

    /// Returns true if phases are disclosed. `ended` is true after the end of the episode.
    pub fn tells(self, ended: bool) -> bool {
        match self {
            Disclosure::Live => true,
            Disclosure::End => ended,
            Disclosure::Never => false,
        }
    }

    /// Returns true if the last phase ends the episode.
    pub fn ends_on_success(self) -> bool {
        self == Disclosure::Live
    }
}

impl fmt::Display for Disclosure {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.pad(self.name())
    }
}

/// Grasping hints in texts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Hints {
    /// Recipes for grasping: finger angles, approaches, orders of closing.
    #[default]
    On,
    /// Nothing.
    Off,
}

impl Hints {
    /// Both variants.
    pub const ALL: [Hints; 2] = [Hints::On, Hints::Off];

    /// Returns the name that JSON, command lines and reports use.
    pub fn name(self) -> &'static str {
        match self {
            Hints::On => "on",
            Hints::Off => "off",
        }
    }
}

impl fmt::Display for Hints {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.pad(self.name())
    }
}

/// Remaining budget of an episode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Budget {
    /// Control steps of 20 ms.
    pub steps_left: u32,
    /// Seconds that the policy may still spend between calls; the simulator's time is not counted. Null where
    /// the protocol sets no limit.
    pub wall_clock_left_s: Option<f64>,
    /// Maximum number of steps per command.
    pub steps_per_command: u32,
}

/// A reached phase of the task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PhaseReached {
    /// Name of the phase, for example `grasp_and_lift`.
    pub id: String,
    /// `p1`, `p2`, ... in the order they have to be reached.
    pub number: String,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
}

/// The phase to reach next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NextPhase {
    /// Name of the phase, for example `place`.
    pub id: String,
    /// `p1`, `p2`, ... in the order they have to be reached.
    pub number: String,
    /// Conditions that do not hold yet, one sentence each. Empty where the next control step reaches the
    /// phase.
    pub lacks: Vec<String>,
    /// Objects that count as held for phases, by the simulator's contact forces; for an operator only those
    /// of its robot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub held: Vec<HeldObject>,
}

/// An object in a hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeldObject {
    /// The robot, for example "A".
    pub robot: String,
    /// `left` or `right`.
    pub hand: String,
    /// The object.
    pub object: String,
    /// Frame of `middle_m` and `axis`: "level", the upright pelvis frame; after `walk_to`, the frame of its
    /// targets.
    pub frame: PoseFrame,
    /// Middle of the object, [x, y, z] in metres.
    pub middle_m: [f64; 3],
    /// Unit vector along its z axis: [0, 0, 1] if upright.
    pub axis: [f64; 3],
    /// Height of its lowest point above the floor, in metres.
    pub lowest_m: f64,
}

/// Fall of a robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotFallen {
    /// The robot, for example "A".
    pub robot: String,
    /// True from the moment it fell.
    pub fallen: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starts_say_what_policies_are_told() {
        let own = |assistance: Assistance| assistance.about(assistance.disclosure(), assistance.hints());
        let paper = "assistance paper: policies are told what the benchmark tells its agents";
        assert_eq!(own(Assistance::Paper), format!("{paper}, success at the end of the episode"));
        let live = Assistance::Paper.about(Disclosure::Live, Hints::On);
        assert_eq!(live, format!("{paper}, phases as they are reached, and how to grasp"));
        let full = "assistance full: policies are told all that robots sense";
        assert_eq!(own(Assistance::Full), format!("{full}, phases as they are reached, and how to grasp"));
    }

    #[test]
    fn json_has_the_same_names() {
        let check = |written: serde_json::Value, named: String, name: &str| {
            assert_eq!((written, named.as_str()), (serde_json::json!(name), name));
        };
        for kind in Protocol::ALL {
            check(serde_json::json!(kind), kind.to_string(), kind.name());
        }
        for kind in Assistance::ALL {
            check(serde_json::json!(kind), kind.to_string(), kind.name());
        }
        for kind in Disclosure::ALL {
            check(serde_json::json!(kind), kind.to_string(), kind.name());
        }
        for kind in Hints::ALL {
            check(serde_json::json!(kind), kind.to_string(), kind.name());
        }
    }
}
