//! Every barrier's row against central differences of its distance, on the whole G1.

use nalgebra::{Point3, Vector3};

use super::*;
use crate::differences::{WITHIN, differences, robot, somewhere};
use crate::model::Configuration;
use crate::qp::{Qp, Rows};

#[test]
fn barrier_rows_are_derivatives_of_distances() {
    let model = robot();
    let configuration = Configuration::new(&model, &somewhere(&model)).expect("all joints");
    let [left, right, torso] =
        ["left_wrist", "right_wrist", "torso_link"].map(|frame| model.frame(frame).expect("a frame"));
    let ends = [Point3::new(0.0, 0.0, 0.0), Point3::new(0.15, 0.02, 0.01)];
    let capsule = |frame, ends| Capsule { frame, ends, radius_m: 0.03 };
    let head = [Point3::new(0.0, 0.0, 0.4); 2];
    let shapes = SelfCollision {
        capsules: vec![capsule(left, ends), capsule(right, ends), capsule(torso, head)],
        pairs: vec![[0, 1], [0, 2], [2, 1]],
        margin_m: 0.01,
        range_m: 10.0,
        gain: 0.5,
    };
    let plane =
        PositionBarrier { frame: left, normal: Vector3::new(0.6, 0.0, 0.8), offset_m: 0.1, gain: 0.5 };
    let barrier_rows = |at: &Configuration| -> Vec<(Vec<f64>, f64)> {
        let (mut qp, mut owners) = (Qp::new(model.nv()), Vec::new());
        let mut rows = Rows { qp: &mut qp, owners: &mut owners };
        shapes.write(at, &mut Vec::new(), &mut rows, |pair| pair);
        plane.write(at, rows.push(shapes.pairs.len()));
        qp.rows().iter().map(|row| (row.coefficients.clone(), -row.bound / 0.5)).collect()
    };
    let derivatives =
        differences(&configuration, |at| barrier_rows(at).iter().map(|(_, height)| *height).collect());
    let rows = barrier_rows(&configuration);
    assert_eq!(rows.len(), 4);
    for (number, (row, _)) in rows.iter().enumerate() {
        for (joint, value) in row.iter().enumerate() {
            let difference = derivatives[joint][number];
            assert!(
                (value - difference).abs() < WITHIN,
                "row {number}, joint {joint}: {value} against {difference}"
            );
        }
    }
}
