//! Errors of an episode's calls. A refused call leaves the world unchanged. Only diverged physics ends the
//! episode.

use std::path::PathBuf;

use tandem_tools_spec::{Color, EndReason, Refusal, RefusalClass, ResultReply, SpecError, SurfaceQuery};

/// Reason why an episode refuses a call. The text says what would work, because its reader is often a
/// language model.
#[derive(Debug, thiserror::Error)]
pub enum EpisodeError {
    #[error("no task {id:?}; have: {}", .have.join(", "))]
    UnknownTask { id: String, have: Vec<String> },
    #[error("no robot {name:?} in this episode; have: {}", .have.join(", "))]
    UnknownRobot { name: String, have: Vec<String> },
    #[error(
        "robot {name:?} is another operator's; yours is {own:?}, and you look through it and command it alone"
    )]
    ForeignRobot { name: String, own: String },
    #[error(
        "the episode stands at step {now} and not at {expected}; look again, then command with expected_step \
         {now}"
    )]
    OtherStep { expected: u32, now: u32 },
    #[error(
        "the {protocol} protocol gives no depth images; measure at pixels with query_depth, or start the \
         episode under the benchmark protocol"
    )]
    DepthImage { protocol: &'static str },
    #[error("{asked} control steps in one command; the {protocol} protocol allows 1 to {most}")]
    TooManySteps { asked: u32, most: u32, protocol: &'static str },
    #[error(
        "pixel [{u}, {v}] is outside the image; u goes from 0 to {}, v from 0 to {}",
        .width - 1, .height - 1
    )]
    PixelOutside { u: i64, v: i64, width: u32, height: u32 },
    #[error(
        "the camera has no depth at pixel [{u}, {v}]: a D435i measures from 0.28 m to 10 m, and not what lies \
         behind the left edge of something near; choose a pixel beside it"
    )]
    NoDepth { u: i64, v: i64 },
    #[error("{}", no_surface(query, seen))]
    NoSurface {
        query: SurfaceQuery,
        /// Colours that are partly visible, for a query by colour.
        seen: Vec<Color>,
    },
    #[error(
        "the episode has ended ({}); observe, get_robot_state, get_status and finish still answer; \
         start_episode begins another",
        reason_text(*.reason)
    )]
    Ended {
        reason: EndReason,
        /// The result, in the form that the policy sees.
        result: Box<ResultReply>,
    },
    #[error(transparent)]
    Spec(#[from] SpecError),
    #[error("the world cannot be built: {0}")]
    Sim(#[from] tandem_sim::SimError),
    #[error(
        "the episode ends here: in step {step}, {source}; in another episode, command less effort or slower \
         motion"
    )]
    Diverged { step: u64, source: tandem_sim::dynamics::Diverged },
    #[error("inverse kinematics cannot use the robot's file: {0}")]
    Ik(#[from] tandem_ik::IkError),
    #[error("a picture cannot be encoded: {0}")]
    Picture(#[from] tandem_sim::render::PictureError),
    #[error(
        "nobody has worded the task {task:?} in other words, which the stress words-1 to words-3 needs; \
         have: {}; the other axes can be laid over every task",
        .have.join(", ")
    )]
    NoOtherWords { task: String, have: Vec<&'static str> },
    #[error(transparent)]
    Scene(Box<SceneError>),
    #[error(transparent)]
    Robot(Box<RobotError>),
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    #[error("cannot read this program's own file, which tells it from other builds: {0}")]
    Build(#[source] std::io::Error),
    #[error(transparent)]
    Output(#[from] crate::output::OutputError),
}

impl EpisodeError {
    /// Maps this error to the refusal that its caller receives.
    pub const fn refusal(&self) -> Refusal {
        use RefusalClass::{Conflict, Invalid, NotFound};
        match self {
            EpisodeError::UnknownTask { .. } => Refusal::new("unknown-task", "Unknown task", NotFound),
            EpisodeError::UnknownRobot { .. } => Refusal::new("unknown-robot", "Unknown robot", Invalid),
            EpisodeError::ForeignRobot { .. } => {
                Refusal::new("foreign-robot", "Another operator's robot", Conflict)
            }
            EpisodeError::OtherStep { .. } => Refusal::new("other-step", "Another step", Conflict),
            EpisodeError::DepthImage { .. } => Refusal::new("depth-image", "No depth images", Conflict),
            EpisodeError::TooManySteps { .. } => Refusal::new("too-many-steps", "Too many steps", Invalid),
            EpisodeError::PixelOutside { .. } => {
                Refusal::new("pixel-outside", "Pixel outside the image", Invalid)
            }
            EpisodeError::NoDepth { .. } => Refusal::new("no-depth", "No depth there", Conflict),
            EpisodeError::NoSurface { .. } => Refusal::new("no-surface", "No such surface", Conflict),
            EpisodeError::Ended { .. } => Refusal::new("ended", "Episode ended", Conflict),
            EpisodeError::Spec(error) => error.refusal(),
            EpisodeError::Diverged { .. } => Refusal::new("diverged", "Physics diverged", Conflict),
            EpisodeError::NoOtherWords { .. } => Refusal::new("no-other-words", "No other words", Invalid),
            EpisodeError::Scene(_) => Refusal::new("scene", "Scene does not fit the task", Invalid),
            EpisodeError::Robot(_) => Refusal::new("robot", "Robot does not fit", Invalid),
            EpisodeError::Checkpoint(_) => Refusal::new("checkpoint", "Checkpoint does not fit", Invalid),
            EpisodeError::Sim(_)
            | EpisodeError::Ik(_)
            | EpisodeError::Picture(_)
            | EpisodeError::Build(_)
            | EpisodeError::Output(_) => Refusal::INTERNAL,
        }
    }
}

impl From<SceneError> for EpisodeError {
    fn from(error: SceneError) -> EpisodeError {
        EpisodeError::Scene(Box::new(error))
    }
}

impl From<RobotError> for EpisodeError {
    fn from(error: RobotError) -> EpisodeError {
        match error {
            RobotError::Sim(error) => EpisodeError::Sim(error),
            error => EpisodeError::Robot(Box::new(error)),
        }
    }
}

/// Reason why an episode cannot use its robots.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    #[error(transparent)]
    Sim(#[from] tandem_sim::SimError),
    #[error(
        "the robot {} has changed: it was {was} and is {now}, with the files that it names; an episode is \
         replayed and resumed with the robot that it was played with",
        path.display()
    )]
    Changed { path: PathBuf, was: String, now: String },
    #[error(
        "{task} needs hands that close, and the robot {robot} has none; give by --task-file a task whose \
         conditions ask for no grip, for example gateway/examples/tasks/pass_the_parcel.toml, or by --robot \
         a robot with thumbs and fingers"
    )]
    NoFingers { task: String, robot: String },
    #[error("the robot {robot} cannot have this base controller: {what}")]
    Controller { robot: String, what: String },
}

/// Reason why a task cannot take place in a scene.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    #[error(transparent)]
    Sim(#[from] tandem_sim::SimError),
    #[error(
        "the scene {} has changed: it was {was} and is {now}, with the files that it names; an episode is \
         replayed and resumed in the scene that it was played in",
        path.display()
    )]
    Changed { path: PathBuf, was: String, now: String },
    #[error(
        "{name} is a body of the scene of {task}, so {task} takes place there; leave out the scene {}",
        path.display()
    )]
    OwnScene { path: PathBuf, task: String, name: String },
    #[error(
        "the scene {} has no site \"task\" on what never moves: give it one where the origin of {task} is to \
         be, its z axis up; sites {} may place robots and objects one by one; have: {have}",
        path.display(), .may.join(", ")
    )]
    NoPlace { path: PathBuf, task: String, may: Vec<String>, have: String },
    #[error(
        "site {site:?} of the scene {} is tilted by {tilt_deg:.1} degrees; its z axis has to be up",
        path.display()
    )]
    Tilted { path: PathBuf, site: String, tilt_deg: f32 },
    #[error(
        "the scene {} has a body {name:?}, which is also the name of an object of {task}; rename it",
        path.display()
    )]
    SameName { path: PathBuf, task: String, name: String },
    #[error(
        "in the scene {}, {name} does not stay where {task} puts it, ({:.2}, {:.2}, {:.2}) m from site \
         \"task\": in {trial_s:.2} s it goes {moved_m:.2} m; it needs something to stand on and nothing in \
         its way; a site {site:?} puts it elsewhere",
        path.display(), .at_m[0], .at_m[1], .at_m[2]
    )]
    Unsteady {
        path: PathBuf,
        task: String,
        name: String,
        site: String,
        at_m: [f32; 3],
        moved_m: f32,
        trial_s: f64,
    },
    #[error(
        "in the scene {}, in a trial of {trial_s:.0} s, in which nobody acts, {source}; look there for \
         shapes that begin within each other, masses of less than a gram, and springs or actuators that are \
         too strong for what they move",
        path.display()
    )]
    Diverged { path: PathBuf, trial_s: f64, source: tandem_sim::dynamics::Diverged },
}

/// Reason why an episode cannot resume from a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    #[error("cannot read the checkpoint {}: {source}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    #[error("{} is no checkpoint of an episode: {source}", path.display())]
    NotOne { path: PathBuf, source: serde_json::Error },
    #[error(
        "the checkpoint {} was made by build {made_by} of {episode}; this is build {this}, and only the \
         build that made a checkpoint goes on from it",
        path.display()
    )]
    OtherBuild { path: PathBuf, made_by: String, episode: String, this: &'static str },
    #[error(
        "the checkpoint {} is torn: {have} of its {expected} bytes are as they were written; make it again",
        path.display()
    )]
    Torn { path: PathBuf, have: usize, expected: usize },
    #[error(
        "{} has no checkpoint where {phase} begins; an episode that reached the phase before it has one",
        path.display()
    )]
    NoPhase { path: PathBuf, phase: String },
    #[error("{0}")]
    Recording(String),
    #[error(
        "{}, played again up to step {step}, goes elsewhere than was recorded: build {made_by} recorded it, \
         this is build {this}, and builds may differ in their physics; begin again with the build that \
         recorded it",
        path.display()
    )]
    OtherWay { path: PathBuf, step: u64, made_by: String, this: &'static str },
    #[error("the checkpoint was made of {made_of}; it fits that episode, and this one is {wanted}")]
    OtherEpisode { made_of: String, wanted: String },
    #[error("the checkpoint holds the progress of other robots or objects than it says; make it again")]
    OtherContent,
    #[error(
        "{} begins elsewhere than at its task's beginning, and holds no checkpoint of where; recordings that \
         this version of Tandem makes have it",
        path.display()
    )]
    NoBeginning { path: PathBuf },
    #[error("the progress in a checkpoint cannot be read or written: {0}")]
    Progress(#[from] postcard::Error),
}

fn no_surface(query: &SurfaceQuery, seen: &[Color]) -> String {
    let name = |color: &Color| format!("{color:?}").to_lowercase();
    let advice = "look with observe, and give a pixel that is on it";
    match (query.color, &query.object, query.pixel) {
        (Some(color), _, _) => {
            let seen: Vec<String> = seen.iter().map(name).collect();
            format!(
                "nothing of any size in the picture is {}; there is something {}; {advice}",
                name(&color),
                seen.join(", ")
            )
        }
        (None, Some(object), _) if object == SurfaceQuery::ALL => {
            "the robot sees no object of the task from here; turn to where `room` has one by walk, with look_at_m or yaw_rate_rad_s".into()
        }
        (None, Some(object), _) => format!(
            "the robot does not see the {object} from here; turn to where `room` has it by walk, with look_at_m or yaw_rate_rad_s, or go round what hides it"
        ),
        (None, None, pixel) => format!("nothing is seen at pixel {:?}; {advice}", pixel.unwrap_or_default()),
    }
}

fn reason_text(reason: EndReason) -> &'static str {
    match reason {
        EndReason::TaskComplete => "its last phase was reached",
        EndReason::StepBudgetExhausted => "its control steps are used up",
        EndReason::WallClockExhausted => "the policy's wall clock ran out",
        EndReason::Finished => "it was finished",
        EndReason::Abandoned => "no call came for too long",
        EndReason::PolicyFailed => "its policy failed",
        EndReason::SimulatorFailed => "the simulator failed",
    }
}
