//! Rows of observations and actions: the layout that data sets and environments share.
//!
//! A row is one moment of a robot: its state, and its action until the next row. Joint targets and the pelvis
//! height are to be reached by the next row, on a straight line; base velocities hold until then. At the
//! control rate, a row is one row of `send_joint_chunk`.

mod actions;
mod column;
mod contract;

pub use actions::{ActionKind, between_rows, joint_row, velocities};
pub use column::RowColumn;
pub use contract::{
    ROW_CONTRACT_VERSION, ROW_RATES_HZ, RowContract, STATE_COLUMNS, state_row, steps_per_row,
};
