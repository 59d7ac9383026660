//! Grasp, hold, handover and release of objects.

mod compliant;
mod cylinder;
mod grasp;
mod hand_over;
mod hold;

pub use compliant::{grasp_compliantly, grasp_reached, let_go};
pub use cylinder::{CylinderGrasp, closed_rad, pick_up_all, wrapped_rad};
pub use grasp::{HandGrasp, move_together, take_together};
pub use hand_over::{hand_over, pick_up, release, stand_on};
pub use hold::Hold;
