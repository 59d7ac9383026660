//! Names, units and ranges of the columns of a robot's rows.

use serde::Serialize;
use tandem_sim::{BaseLimits, CONTROL_HZ, JOINTS, RobotStep};
use tandem_tools_spec::BASE_COLUMNS;

use super::actions::ActionKind;
use super::column::{RowColumn, joint_column};
use crate::commands::base_row;
use crate::error::RobotError;
use crate::spec::EpisodeSpec;

/// Version of the layout. Increase it when names, order, units or meaning of a column change.
pub const ROW_CONTRACT_VERSION: u32 = 1;

/// Rates at which rows are written and played: those that divide the control rate.
pub const ROW_RATES_HZ: [u32; 3] = [50, 25, 10];
const _: () = assert!(ROW_RATES_HZ[0] as f64 == CONTROL_HZ);

/// Number of values of a robot's state: its joints' angles (rad), then the base command in force.
pub const STATE_COLUMNS: usize = JOINTS + BASE_COLUMNS.len();

const BASE_UNITS: [&str; 4] = ["m/s", "m/s", "rad/s", "m"];

/// Columns of one robot's rows. Rows of several robots follow one another in the task's order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RowContract {
    pub version: u32,
    pub state: Vec<RowColumn>,
    pub action: Vec<RowColumn>,
}

impl RowContract {
    /// Returns the layout for the robots of an episode.
    ///
    /// # Errors
    ///
    /// If the robot or its base controller cannot be read.
    pub fn of(episode: &EpisodeSpec, actions: ActionKind) -> Result<RowContract, RobotError> {
        let model = episode.robot.model()?;
        let base = episode.locomotion.limits(&episode.robot)?;
        let joints = (0..JOINTS).map(|joint| joint_column(&model, joint));
        Ok(RowContract {
            version: ROW_CONTRACT_VERSION,
            state: joints.chain(base_columns(&base)).collect(),
            action: actions.columns(&model).into_iter().chain(base_columns(&base)).collect(),
        })
    }
}

/// Returns the number of control steps of a row.
///
/// # Errors
///
/// If the rate is not one of [`ROW_RATES_HZ`].
pub fn steps_per_row(rate_hz: u32) -> Result<u32, String> {
    match ROW_RATES_HZ.contains(&rate_hz) {
        true => Ok(ROW_RATES_HZ[0] / rate_hz),
        false => {
            let have = ROW_RATES_HZ.map(|rate_hz| rate_hz.to_string()).join(", ");
            Err(format!("no rate of {rate_hz} Hz; have: {have}"))
        }
    }
}

fn base_columns(limits: &BaseLimits) -> impl Iterator<Item = RowColumn> {
    let BaseLimits { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m } = *limits;
    let ranges = [vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m];
    let named = BASE_COLUMNS.into_iter().zip(BASE_UNITS).zip(ranges);
    named.map(|((name, unit), [min, max])| RowColumn { name: name.into(), unit, min, max })
}

/// Yields the values of a robot's state in the order of [`RowContract::state`].
pub fn state_row(robot: &RobotStep) -> impl Iterator<Item = f32> {
    robot.sensed.joints.q_rad.into_iter().chain(base_row(&robot.command.base))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use tandem_tools_spec::Protocol;

    use super::*;
    use crate::tasks;

    #[test]
    fn every_column_has_its_own_name_and_a_range() {
        let task = tasks::find("handover").unwrap();
        let spec = EpisodeSpec::new(&task, 2000, Protocol::Benchmark);
        for kind in ActionKind::ALL {
            let contract = RowContract::of(&spec, kind).unwrap();
            assert_eq!(contract.action.len(), kind.row_len());
            for columns in [&contract.state, &contract.action] {
                let names: BTreeSet<_> = columns.iter().map(|column| &column.name).collect();
                assert_eq!(names.len(), columns.len());
                assert!(columns.iter().all(|column| column.min < column.max));
            }
        }
    }
}
