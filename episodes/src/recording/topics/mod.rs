//! The topics of a recording.

pub mod messages;
pub mod notes;
pub mod robot;
pub mod scene;
pub mod steps;
pub mod transforms;

/// Topics that are read back.
pub const STEPS: &str = "/steps";
pub const PHASES: &str = "/phases";
pub const TOOL_CALLS: &str = "/tool_calls";
pub const NOTES: &str = "/notes";
