//! What several experts use: hands that move together, grasps, and the shapes of a hand.

mod bar;
mod cylinder;
mod hand;
mod stage;

pub use bar::{BarGrasp, move_together, take_together};
pub use cylinder::{CylinderGrasp, pick_up_all};
pub use stage::{HandMove, Stage};
