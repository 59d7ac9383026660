//! Where colliders touch, and what a contact asks of the velocities there.

pub mod collider;
pub mod collision;
pub mod contact;
pub mod friction;
mod near;
pub mod touch;
