//! A number of a row, with its unit and range.

use serde::Serialize;
use tandem_sim::RobotModel;

/// A number of a row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RowColumn {
    /// Unique name that ends in the unit.
    pub name: String,
    pub unit: &'static str,
    /// Minimum of the range to which actions are clamped, in the unit.
    pub min: f32,
    pub max: f32,
}

/// Returns the column of a joint in published order.
pub fn joint_column(model: &RobotModel, joint: usize) -> RowColumn {
    let joint = &model.joints[joint];
    RowColumn { name: format!("{}_rad", joint.name), unit: "rad", min: joint.lower_rad, max: joint.upper_rad }
}
