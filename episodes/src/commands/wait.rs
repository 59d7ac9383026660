//! `wait`, and what robots do that are told nothing new: the base stands, and hands go on to where they were told to be.

use super::motion::{Compliance, Motion};

/// One control step.
pub fn hold(motion: &mut Motion) {
    motion.give_way(Compliance::NONE);
    motion.stand();
    motion.follow(&motion.state().aims.clone());
}
