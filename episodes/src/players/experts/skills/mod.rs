//! What several experts use: hands that move together, grasps, the shapes of a hand, walking, and carrying in step.

mod at_once;
mod bar;
mod course;
mod cylinder;
mod ground;
mod hand;
mod soft;
mod stage;
mod team;
mod walk;

pub use at_once::{Part, at_once};
pub use bar::{BarGrasp, move_together, take_together};
pub use course::{Course, FREE, Posture, follow};
pub use cylinder::{CylinderGrasp, pick_up_all};
pub use ground::{place, upright};
pub use hand::closed_rad;
pub use soft::{let_go, take_softly};
pub use stage::{HandMove, Stage};
pub use team::{Path, Team};
pub use walk::{Way, Within, come_near, walk_to};
