//! A number of a row, with its unit and range.

use serde::Serialize;
use tandem_sim::RobotModel;

/// A number of a row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RowColumn {
    /// Unique name that ends in the unit.
    pub name: String,
    pub unit: &'static str,
    /// Minimum and maximum. Actions are clamped to them.
    pub range: [f32; 2],
}

/// Returns the column of a joint in published order.
pub fn joint_column(model: &RobotModel, joint: usize) -> RowColumn {
    let joint = &model.joints[joint];
    RowColumn { name: format!("{}_rad", joint.name), unit: "rad", range: [joint.lower_rad, joint.upper_rad] }
}
