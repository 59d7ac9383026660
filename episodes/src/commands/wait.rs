//! `wait`, and the motion of robots without new commands: the base stands, and hands continue to their
//! targets. A robot whose motors are driven keeps its last setpoints.

use super::motion::{Compliance, Motion};

/// Makes one control step.
pub fn hold(motion: &mut Motion) {
    if motion.keep_driving() {
        return;
    }
    motion.advance_yielding(Compliance::NONE);
    motion.stand();
    motion.follow(&motion.state().aims.clone());
}
