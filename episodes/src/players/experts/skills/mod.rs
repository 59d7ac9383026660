//! What several experts use: hands that move together, grasps, the shapes of a hand, walking, and carrying in step.

mod bar;
mod cylinder;
mod ground;
mod hand;
mod soft;
mod stage;
mod team;
mod walk;

pub use bar::{BarGrasp, move_together, take_together};
pub use cylinder::{CylinderGrasp, pick_up_all};
pub use ground::upright;
pub use soft::{let_go, take_softly};
pub use stage::{HandMove, Stage};
pub use team::{Path, Team};
