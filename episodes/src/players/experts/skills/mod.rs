//! What several experts use: hands that move together, grasps, the shapes of a hand, walking, and carrying in step.

mod carry_team;
mod commander;
mod compliant;
mod cylinder;
mod grasp;
mod hand_over;
mod hold;
mod parallel;
mod posture_path;
mod variety;
mod walk;
mod walked_way;

pub use carry_team::{COMPLIANCE_N_S_M, CarryTeam, ObjectPath};
pub use commander::{Commander, HandMove, smooth};
pub use compliant::{grasp_compliantly, grasp_reached, let_go};
pub use cylinder::{CylinderGrasp, closed_rad, pick_up_all, wrapped_rad};
pub use grasp::{HandGrasp, move_together, take_together};
pub use hand_over::{hand_over, pick_up, release, stand_on};
pub use hold::Hold;
pub use parallel::{ParallelScript, in_parallel};
pub use posture_path::{FREE, Posture, PosturePath, follow};
pub use variety::Variety;
pub use walk::{Tolerance, WalkGoal, approach, at_hand, place, upright, walk_to};
