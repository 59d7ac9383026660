//! Episodes: tasks and their phases, budgets, grasp detection, and the session that runs tool calls on a
//! world.
//!
//! A [`Session`] is one episode. It answers tool calls, and its result says which phases they reached:
//!
//! ```
//! use tandem_episodes::{EpisodeError, EpisodeSpec, Session, tasks};
//! use tandem_tools_spec::{GetStatus, Protocol, Wait};
//!
//! let spec = EpisodeSpec::new(&tasks::find("handover")?, 0, Protocol::Benchmark);
//! let mut session = Session::start(&spec, None)?;
//! session.call(Wait { steps: 10 }.into())?;
//! session.call(GetStatus::default().into())?;
//! let result = session.close();
//! assert_eq!((result.env_steps, result.tool_calls), (10, 2));
//! assert_eq!(result.phases.reached_s("p1"), None);
//! # Ok::<(), EpisodeError>(())
//! ```

mod commands;
mod conditions;
mod convert;
mod describe;
mod error;
mod fingerprint;
pub mod html;
mod instructions;
pub mod live;
mod locks;
mod observation;
mod output;
pub mod pages;
pub mod players;
mod protocol;
mod recording;
pub mod replay;
mod result_file;
pub mod rows;
mod scoring;
mod session;
mod spec;
pub mod stress;
pub mod tasks;
mod variation;
mod words;

pub use commands::{Called, OperatorCall, OperatorCommand, upper_body};
pub use conditions::{FUNCTIONS, Function};
pub use convert::isometry_from_sim;
pub use describe::{brief, task_list, teamwork};
pub use error::{CheckpointError, EpisodeError, RobotError, SceneError};
pub use fingerprint::{build, name_program};
pub use instructions::{Instructions, InstructionsError};
pub use locks::{FileLock, LockKind, Locking};
pub use observation::{Picture, RobotObservation, RobotView, TeamObservation, scaled_colours};
pub use output::{
    OutputError, create_new_private_folder, create_private_folder, partial_path, printable, shell_word,
    write_whole,
};
pub use pages::{SIDES_FILE, draw_sides};
pub use protocol::{Rules, rules};
pub use recording::{
    Damage, Fault, FilePart, LeftOut, LiveChannel, LiveRecording, LiveViewer, MAX_RECORDING_BYTES,
    NoteMessage, RecordedCall, RecordedCheckpoint, RecordedSetpoints, Recorder, Recording, RecordingError,
    RecoverError, Recovered, ShownPicture, ToolCallMessage, TranscriptEntry, Visibility, recover,
};
pub use result_file::{RESULT_FILE, write_result};
pub use scoring::{
    A, B, C, Done, Facts, Grip, Milestone, ObjectFacts, Phase, Predicate, RobotFacts, Scores, StepScore,
};
pub use session::{
    Audience, BringBack, Built, CallReply, Caller, Checkpoint, Clock, FAILED_STEP_FILE, FailedStep,
    JournalEntry, Outcome, PlanAdvance, PlanRun, Request, RunFiles, RunFolder, Session, build_world,
    monotonic,
};
pub use spec::{Controller, EpisodeSpec, KeyedSeed, MomentStart, OwnRobot, PhaseStart, RobotFile, Start};
pub use tandem_sim::{
    BaseLimits, CONTROL_HZ, LocomotionChoice, MAX_TEXT_BYTES, Sensing, SensorModel, SimError, StateSource,
    assets::{DEFAULT_ROBOT, ROBOTS, robot as embedded_robot},
    body::BodyScale,
    joint_names, read_bytes, read_text,
    render::{CameraModel, RendererKind},
};
pub use tasks::{SceneFile, TANDEM_PLUS, TaskFileError, read_task, tandem_plus, task_of};
pub use variation::Variation;
pub use words::OwnWords;
