//! Jacobians against central differences, on the whole G1.

use nalgebra::Vector6;

use super::*;
use crate::differences::{WITHIN, differences, robot, somewhere};
use crate::spatial::Log6;

#[test]
fn frame_jacobian_is_the_body_velocity() {
    let model = robot();
    let configuration = Configuration::new(&model, &somewhere(&model)).expect("all joints");
    let frame = model.frame("right_palm").expect("a site");
    let mut columns = vec![Vector6::zeros(); model.nv()];
    configuration.frame_jacobian(frame, &mut columns);
    let here = configuration.root_from_frame(frame).inverse();
    let derivatives = differences(&configuration, |at| {
        Log6::of(&(here * at.root_from_frame(frame))).twist.as_slice().to_vec()
    });
    for (joint, column) in columns.iter().enumerate() {
        let difference = Vector6::from_column_slice(&derivatives[joint]);
        assert!((column - difference).amax() < WITHIN, "joint {joint}: {column} against {difference}");
    }
}
