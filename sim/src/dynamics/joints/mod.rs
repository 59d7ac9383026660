//! What acts along joints: drives, springs, dry friction, limits of position, and equalities between joints and bodies.

pub mod bounds;
pub mod drive;
mod efforts;
pub mod equality;
