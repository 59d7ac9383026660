//! Central differences on the whole G1, for tests of everything that is a derivative.

use crate::model::{Configuration, Joint, Model};

const ROBOT: &str = include_str!("../../sim/assets/robots/g1_dex3/robot.xml");
/// rad; the differences are then good to about 1e-9.
const STEP: f64 = 1e-5;
pub const WITHIN: f64 = 1e-7;

/// Coordinates within every joint's range, different for each joint.
pub fn somewhere(model: &Model) -> Vec<f64> {
    let place = |(index, joint): (usize, &Joint)| {
        0.5 * (joint.lower + joint.upper) + 0.3 * (joint.upper - joint.lower) * (1.7 * index as f64).sin()
    };
    model.joints().iter().enumerate().map(place).collect()
}

/// Central difference of `value` along each joint.
pub fn differences(
    configuration: &Configuration,
    value: impl Fn(&Configuration) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    let shifted = |joint: usize, by: f64| {
        let mut q = configuration.q().to_vec();
        q[joint] += by;
        value(&Configuration::new(configuration.model(), &q).expect("finite"))
    };
    let along = |joint| {
        let (ahead, behind) = (shifted(joint, STEP), shifted(joint, -STEP));
        ahead.iter().zip(behind).map(|(ahead, behind)| (ahead - behind) / (2.0 * STEP)).collect()
    };
    (0..configuration.model().nv()).map(along).collect()
}

pub fn robot() -> Model {
    Model::from_mjcf(ROBOT).expect("the robot's file")
}
