//! What several tools share.

mod command;
mod driving;
mod episode;
mod pictures;
mod quantities;

pub use command::{
    BaseMotion, CommandReply, Effort, FingerReport, HandReport, HandState, RobotReport, StopReason,
};
pub use driving::{Driving, Heard, OperatorToken, Operators, Partner, PartnerDid};
pub use episode::{
    Assistance, Budget, Disclosure, ExtraInformation, Hints, PhaseReached, Protocol, RobotFallen, Wording,
};
pub use pictures::{Bytes, CameraArrays, DepthFormat, Formats, ImageFormat, PixelRegion, Png};
pub use quantities::{BASE_COLUMNS, BaseCommand, BaseLimits, JointValues, Pose, Range};
