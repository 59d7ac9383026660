//! Kinematics against differences of positions, and dynamics against differences of momentum and energy.

use rapier3d::math::Vector;

use super::posed::{Posed, model};
use super::{ARM_JOINTS, ARMS, Acceleration, JOINTS, UPPER, joint_names};
use crate::{GRAVITY_M_S2, Side};

const STILL: Acceleration = Acceleration { linear_m_s2: Vector::ZERO, angular_rad_s2: Vector::ZERO };
/// Time step of differences: the truncation error shrinks with its square, rounding grows with its inverse.
const DT_S: f32 = 0.005;

fn check_near(measured: Vector, expected: Vector, tolerance: f32, what: &str) {
    assert!((measured - expected).length() < tolerance, "{what}: {measured}, not {expected}");
}

/// Returns the states `DT_S` before and after.
fn around(posed: &Posed, pelvis: Acceleration, qdd_rad_s2: &[f32; JOINTS]) -> [Posed; 2] {
    [-DT_S, DT_S].map(|time_s| posed.after(time_s, pelvis, qdd_rad_s2))
}

#[test]
fn the_centre_of_mass_moves_as_its_velocity_says() {
    for seed in 0..5 {
        let posed = Posed::tumbling(seed);
        let [before, after] = around(&posed, STILL, &[0.0; JOINTS]).map(|posed| posed.body().com_m);
        let body = posed.body();
        assert!(body.com_velocity_m_s.length() > 0.1);
        check_near((after - before) / (2.0 * DT_S), body.com_velocity_m_s, 1e-3, "m/s");
    }
}

/// tau_j = J_j . f, with J_j the displacement of the palm per angle of the joint.
#[test]
fn moments_are_those_of_virtual_work() {
    let force_n = Vector::new(3.0, -5.0, 8.0);
    let posed = Posed::tumbling(1);
    let body = posed.body();
    for side in Side::BOTH {
        for joint in ARMS[side]..ARMS[side] + ARM_JOINTS {
            let palm_m = |angle_rad: f32| {
                let mut turned = posed.clone();
                turned.q_rad[joint] += angle_rad;
                turned.body().palms_m()[side]
            };
            let expected_n_m = ((palm_m(DT_S) - palm_m(-DT_S)) / (2.0 * DT_S)).dot(force_n);
            let moment_n_m = body.moment_n_m(joint, body.palms_m()[side], force_n);
            assert!((moment_n_m - expected_n_m).abs() < 2e-3, "{moment_n_m} {expected_n_m}");
        }
    }
}

#[test]
fn gravity_torques_are_the_slope_of_the_potential_energy() {
    let weight_n = model().mass_kg * GRAVITY_M_S2;
    let mut posed = Posed::tumbling(2);
    (posed.pelvis_velocity_m_s, posed.pelvis_angular_velocity_rad_s) = (Vector::ZERO, Vector::ZERO);
    let torques_n_m = posed.body().gravity_torques_n_m();
    assert!(torques_n_m.iter().any(|torque| torque.abs() > 5.0));
    for (joint, torque_n_m) in torques_n_m.into_iter().enumerate() {
        let height_m = |angle_rad: f32| {
            let mut turned = posed.clone();
            turned.q_rad[joint] += angle_rad;
            turned.body().com_m.z
        };
        let slope_n_m = (height_m(0.02) - height_m(-0.02)) / 0.04 * weight_n;
        assert!((torque_n_m - slope_n_m).abs() < 0.02, "joint {joint}: {torque_n_m} {slope_n_m}");
    }
}

/// A robot at rest needs an external force equal to its weight, and its joints need gravity's torques.
#[test]
fn rest_takes_the_weight() {
    let body = Posed::standing().body();
    let weight_n = Vector::new(0.0, 0.0, body.model.mass_kg * GRAVITY_M_S2);
    let rest = body.inverse_dynamics(STILL, &[0.0; JOINTS]);
    check_near(rest.force_n, weight_n, 1e-2, "N");
    let lever_m = body.com_m - body.world_from_pelvis().translation;
    check_near(rest.moment_n_m, lever_m.cross(weight_n), 1e-2, "N m");
    for (torque, gravity) in rest.torque_n_m.iter().zip(body.gravity_torques_n_m()) {
        assert!((torque - gravity).abs() < 1e-3, "{torque} {gravity}");
    }
}

/// The force equals the change of momentum plus the weight. The power of all torques equals the change
/// of energy.
#[test]
fn effort_changes_momentum_and_energy() {
    for seed in 0..5 {
        let posed = Posed::tumbling(seed);
        let pelvis = Acceleration {
            linear_m_s2: Vector::new(1.0, -2.0, 0.5),
            angular_rad_s2: Vector::new(2.0, 1.0, -3.0),
        };
        let qdd_rad_s2 = std::array::from_fn(|i| 3.0 * (0.9 * i as f32 + seed as f32).cos());
        let body = posed.body();
        let effort = body.inverse_dynamics(pelvis, &qdd_rad_s2);

        let [before, after] = around(&posed, pelvis, &qdd_rad_s2);
        let change_m_s2 = (after.body().com_velocity_m_s - before.body().com_velocity_m_s) / (2.0 * DT_S);
        let force_n = (change_m_s2 + Vector::Z * GRAVITY_M_S2) * body.model.mass_kg;
        check_near(effort.force_n, force_n, 0.2, "N");

        let joints_w: f32 = (0..JOINTS)
            .map(|i| {
                let own_n_m = effort.torque_n_m[i] - body.model.joints[i].armature_kg_m2 * qdd_rad_s2[i];
                own_n_m * body.qd_rad_s[i]
            })
            .sum();
        let power_w = effort.force_n.dot(body.pelvis_velocity_m_s)
            + effort.moment_n_m.dot(body.pelvis_angular_velocity_rad_s)
            + joints_w;
        let expected_w = ((after.energy_j() - before.energy_j()) / f64::from(2.0 * DT_S)) as f32;
        assert!((power_w - expected_w).abs() < 0.2, "seed {seed}: {power_w} W, not {expected_w} W");
    }
}

/// The order is defined once; here the action row is written out by name.
#[test]
fn the_action_row_is_arms_hands_waist() {
    let names = joint_names();
    let row = UPPER.map(|joint| names[joint].as_str());
    for (column, name) in [
        (0, "left_shoulder_pitch_joint"),
        (6, "left_wrist_yaw_joint"),
        (7, "right_shoulder_pitch_joint"),
        (14, "left_hand_thumb_0_joint"),
        (20, "left_hand_index_1_joint"),
        (21, "right_hand_thumb_0_joint"),
        (28, "waist_yaw_joint"),
        (30, "waist_pitch_joint"),
    ] {
        assert_eq!(row[column], name);
    }
    assert!(names.iter().all(|name| row.contains(&name.as_str())
        != (name.contains("hip") || name.contains("knee") || name.contains("ankle"))));
}

/// Unitree's MJCF and URDF agree except for ankles, waist roll and waist pitch.
#[test]
fn effort_limits_are_those_of_the_mjcf_or_of_the_urdf() {
    let parse = |name| {
        let text = crate::assets::robot(name).expect("embedded");
        crate::RobotModel::parse("robot.xml", text).expect("a robot")
    };
    let [own, urdf] = crate::assets::ROBOTS.map(parse);
    let mut differ = Vec::new();
    for (own, urdf) in own.joints.iter().zip(&urdf.joints) {
        if own.effort_n_m != urdf.effort_n_m {
            assert_eq!([own.effort_n_m, urdf.effort_n_m], [50.0, 35.0], "{}", own.name);
            differ.push(own.name.as_str());
        }
    }
    let expected = [
        "left_ankle_pitch_joint",
        "left_ankle_roll_joint",
        "right_ankle_pitch_joint",
        "right_ankle_roll_joint",
        "waist_roll_joint",
        "waist_pitch_joint",
    ];
    assert_eq!(differ, expected);
}

/// Unitree's speed limits, each with the motor it belongs to.
#[test]
fn motors_are_as_fast_as_unitree_says() {
    let limit_rad_s = |name: &str| {
        let joints = &model().joints;
        joints.iter().find(|joint| joint.name == name).expect("a joint").speed_limit_rad_s
    };
    for (name, expected_rad_s) in [
        ("left_hip_roll_joint", 20.0),
        ("right_knee_joint", 20.0),
        ("right_hip_yaw_joint", 32.0),
        ("left_ankle_roll_joint", 30.0),
        ("waist_yaw_joint", 32.0),
        ("waist_pitch_joint", 30.0),
        ("left_wrist_roll_joint", 37.0),
        ("right_wrist_yaw_joint", 22.0),
        ("right_hand_index_1_joint", 12.0),
    ] {
        assert_eq!(limit_rad_s(name), expected_rad_s, "{name}");
    }
    assert!((3.13..3.15).contains(&limit_rad_s("left_hand_thumb_0_joint")));
}
