//! A tree of joints with one degree of freedom each, frames fixed to the joints, and the masses that the
//! joints carry. A configuration is the same tree at one set of joint coordinates.

mod configuration;
mod mjcf;
mod parts;
mod tree;
#[cfg(feature = "urdf")]
mod urdf;

pub use configuration::Configuration;
pub use parts::{Frame, FrameId, Joint, JointKind};
pub use tree::Model;
