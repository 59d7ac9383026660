//! What several tools share.

mod arrays;
mod base;
mod command;
mod disclosure;
mod driving;
mod episode;
mod formats;
mod hand;
mod hints;
mod joint_values;
mod png;
mod pose;
mod protocol;
mod region;

pub use arrays::{Bytes, CameraArrays};
pub use base::{BASE_COLUMNS, BaseCommand, BaseLimits, Range};
pub use command::{BaseMotion, CommandReply, RobotReport, StopReason};
pub use disclosure::Disclosure;
pub use driving::{Driving, Heard, OperatorToken, Operators, Partner, PartnerDid};
pub use episode::{Budget, PhaseReached, RobotFallen};
pub use formats::{DepthFormat, Formats, ImageFormat};
pub use hand::{Effort, FingerReport, HandReport, HandState};
pub use hints::Hints;
pub use joint_values::JointValues;
pub use png::Png;
pub use pose::Pose;
pub use protocol::Protocol;
pub use region::PixelRegion;
