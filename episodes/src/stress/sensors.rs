//! Sensor stress: noise, bias and latency as on a real G1, then twice and four times its noise and bias.

use tandem_sim::SensorModel;

use super::StressLevel;

pub fn model(level: StressLevel) -> SensorModel {
    level.of([SensorModel::G1, SensorModel::G1Twice, SensorModel::G1Fourfold])
}
