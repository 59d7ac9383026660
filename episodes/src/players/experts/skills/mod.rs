//! Skills that several experts use: hands that move together, grasps, hand shapes, walking, and carrying in
//! step.

mod carry_team;
mod commander;
mod grasps;
mod parallel;
mod posture_path;
mod variety;
mod walk;
mod walked_way;

pub use carry_team::{COMPLIANCE_N_S_M, CarryTeam, ObjectPath};
pub use commander::{Commander, HandMove, smooth};
pub use grasps::{
    CylinderGrasp, HandGrasp, Hold, closed_rad, grasp_compliantly, grasp_reached, hand_over, let_go,
    move_together, pick_up, pick_up_all, release, stand_on, take_together, wrapped_rad,
};
pub use parallel::{ParallelScript, in_parallel};
pub use posture_path::{FREE, Posture, PosturePath, follow};
pub use variety::Variety;
pub use walk::{Tolerance, WalkGoal, approach, at_hand, at_height, place, upright, walk_reaching, walk_to};
