//! Hand forces while arms move: only external forces are reported, without the inertia of the arms.

use tandem_sim::{
    ARM_COLUMNS, CONTROL_DT_S, RobotCommand, RobotPlacement, RobotStep, Sensing, SensorModel, Side, Vector,
    World, WorldSpec,
};

/// Joint positions with the hands a forearm's length ahead of the chest; true for joints mirrored on the
/// right arm.
const FORWARD: [(f32, bool); 7] =
    [(-0.35, false), (0.3, true), (0.0, true), (0.3, false), (0.0, true), (0.0, false), (0.0, true)];
const RAISED_S: f32 = 2.0;

/// Runs a robot that waves its arms from [`RAISED_S`] on, every joint by 0.3 rad at 1.3 times a second
/// at most. Its right palm is pulled by `pull_n` from `pulled_s` on. Calls `look` at each instant.
fn waves(sensors: SensorModel, pull_n: Vector, pulled_s: f32, mut look: impl FnMut(f32, &RobotStep)) {
    let placement = RobotPlacement { name: "A".into(), position_m: [0.0; 2], yaw_rad: 0.0 };
    let spec = WorldSpec { scene: "floor".into(), robots: vec![placement], objects: vec![] };
    let mut world = World::new(&spec).unwrap();
    world.set_sensing(Sensing { sensors, ..Sensing::default() }, 2000);
    let rest = world.rest_command(0);
    for step in 0..(7.0 / CONTROL_DT_S) as u32 {
        let time_s = step as f32 * CONTROL_DT_S;
        let (raised, waving_s) = ((time_s / RAISED_S).min(1.0), (time_s - RAISED_S).max(0.0));
        let mut upper_rad = rest.upper_rad;
        for side in Side::BOTH {
            for (i, (forward_rad, mirrored)) in FORWARD.into_iter().enumerate() {
                let column = ARM_COLUMNS[side] + i;
                let forward_rad = if mirrored { side.sign() * forward_rad } else { forward_rad };
                let rate_rad_s = 5.0 + i as f32 * 0.5;
                let wave_rad = 0.3 * (rate_rad_s * waving_s).sin() * waving_s.min(1.0);
                upper_rad[column] += raised * (forward_rad - rest.upper_rad[column]) + wave_rad;
            }
        }
        if time_s >= pulled_s {
            world.push(0, "right_wrist_yaw_link", Vector::new(0.12, 0.0, 0.0), pull_n);
        }
        let robot =
            world.control_step(&[RobotCommand { upper_rad, base: rest.base }]).unwrap().robots.remove(0);
        assert!(!robot.truth.fallen, "at {time_s} s");
        look(time_s, &robot);
    }
}

/// Almost no force is reported at empty hands while the arms swing.
#[test]
fn hands_that_wave_feel_little() {
    for (sensors, most_n, mean_n) in [(SensorModel::Ideal, 2.0, 0.8), (SensorModel::G1, 3.0, 1.0)] {
        let (mut greatest_n, mut sum_n, mut count) = (0.0f32, 0.0, 0);
        waves(sensors, Vector::ZERO, f32::INFINITY, |time_s, robot| {
            for side in Side::BOTH {
                if time_s > RAISED_S + 0.5 {
                    let force_n = robot.estimate.hand_force_n[side].length();
                    greatest_n = greatest_n.max(force_n);
                    sum_n += force_n;
                    count += 1;
                }
            }
        });
        let found_n = sum_n / count as f32;
        println!("{sensors:?}: {found_n} N in the mean, {greatest_n} N at most");
        assert!(found_n < mean_n && greatest_n < most_n, "{sensors:?}: {found_n} N, {greatest_n} N");
    }
}

/// A pull is reported while the arms wave, most of it within 0.3 s.
#[test]
fn a_pull_is_felt_while_the_arms_wave() {
    let (pull_n, pulled_s) = (Vector::new(0.0, 0.0, -12.0), 4.0);
    waves(SensorModel::Ideal, pull_n, pulled_s, |time_s, robot| {
        let force_n = robot.estimate.hand_force_n[Side::Right];
        if (pulled_s - 0.5..pulled_s).contains(&time_s) {
            assert!(force_n.length() < 3.0, "{force_n} N before the pull");
        }
        if time_s > pulled_s + 0.3 {
            println!("{time_s} {force_n}");
            let error_n = (force_n - pull_n).length();
            let most_n = if time_s < pulled_s + 0.8 { 5.0 } else { 3.0 };
            assert!(error_n < most_n, "{force_n} N at {time_s} s");
        }
    });
}
