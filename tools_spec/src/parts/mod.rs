//! Types that several tools share.

mod command;
mod driving;
mod episode;
mod frames;
mod note;
mod pictures;
mod plan;
mod quantities;

pub use command::{
    BaseMotion, BaseReport, BaseState, CommandReply, Effort, FingerReport, Grip, HandPart, HandReport,
    HandState, RobotReport, StopReason, Touch,
};
pub use driving::{
    Driving, Heard, OperatorToken, OperatorUse, Operators, Partner, PartnerDid, Presence, PresenceState,
};
pub use episode::{
    Assistance, Budget, Disclosure, ExtraInformation, HeldObject, Hints, NextPhase, PhaseReached, Protocol,
    RobotFallen, Wording,
};
pub use frames::{PoseFrame, null_is_default};
pub use note::{AgentEnding, ModelEnding, Note, NoteKind, RobotUsage, TokenCount, Usage};
pub use pictures::{Bytes, CameraArrays, DepthFormat, Formats, ImageFormat, PixelRegion, Png};
pub use plan::PlanReply;
pub use quantities::{BASE_COLUMNS, BaseCommand, BaseLimits, JointValues, Pose, Range};
