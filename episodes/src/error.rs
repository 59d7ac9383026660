//! Why an episode refuses a call. None of these changes the world.

use tandem_tools_spec::{EndReason, SpecError};

/// The text says what would work, because its reader is often a language model.
#[derive(Debug, thiserror::Error)]
pub enum EpisodeError {
    #[error("no task {id:?}; have: {}", .have.join(", "))]
    UnknownTask { id: String, have: Vec<&'static str> },
    #[error("no robot {name:?} in this episode; have: {}", .have.join(", "))]
    UnknownRobot { name: String, have: Vec<String> },
    #[error("{asked} control steps in one command; the {protocol} protocol allows 1 to {most}")]
    TooManySteps { asked: usize, most: u32, protocol: &'static str },
    #[error("pixel [{u}, {v}] is outside the image; u goes from 0 to {}, v from 0 to {}", .width - 1, .height - 1)]
    PixelOutside { u: i64, v: i64, width: u32, height: u32 },
    #[error("the episode has ended ({}); get_status and finish still answer; start_episode begins another", reason_text(*.reason))]
    Ended { reason: EndReason },
    #[error(transparent)]
    Spec(#[from] SpecError),
    #[error("the world cannot be built: {0}")]
    Sim(#[from] tandem_sim::SimError),
    #[error("inverse kinematics cannot use the robot's file: {0}")]
    Ik(#[from] tandem_ik::IkError),
    #[error("a picture cannot be encoded: {0}")]
    Picture(#[from] tandem_sim::render::PictureError),
    #[error(transparent)]
    Checkpoint(#[from] crate::session::CheckpointError),
    #[error("cannot read this program's own file, which tells it from other builds: {0}")]
    Build(#[source] std::io::Error),
    #[error(transparent)]
    Output(#[from] crate::output::OutputError),
}

fn reason_text(reason: EndReason) -> &'static str {
    match reason {
        EndReason::TaskComplete => "its last phase was reached",
        EndReason::StepBudgetExhausted => "its control steps are used up",
        EndReason::WallClockExhausted => "the policy's wall clock ran out",
        EndReason::Finished => "it was finished",
    }
}
