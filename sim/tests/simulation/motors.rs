//! Tests of motors: their maximum speed under any command, and setpoints that replace drives and base
//! controller.

use tandem_sim::{
    ARM_COLUMNS, CONTROL_DT_S, JOINTS, MotorSetpoints, PHYSICS_DT_S, RobotCommand, RobotPlacement, Side,
    UPPER, UPPER_JOINTS, WAIST_COLUMN, World, WorldSpec,
};

/// Shoulder pitch, roll and elbow, which hold the hands away from the body.
const FORWARD: [(usize, f32, bool); 3] = [(0, -0.35, false), (1, 0.5, true), (3, 0.3, false)];
const RAISED_S: f32 = 1.5;
const JUMPS_S: f32 = 0.3;

/// Returns a world with one robot on a floor.
fn on_floor() -> World {
    let placement = RobotPlacement { name: "A".into(), position_m: [0.0; 2], yaw_rad: 0.0 };
    World::new(&WorldSpec { scene: "floor".into(), robots: vec![placement], objects: vec![] }).unwrap()
}

/// Returns the greatest speed of a joint, as a share of its motor's, when its target jumps from one end
/// of its range to the other and back.
fn fastest_share(column: usize) -> f32 {
    let mut world = on_floor();
    let rest = world.rest_command(0);
    let joint = world.robots()[0].model.joints[UPPER[column]].clone();
    let mut forward_rad = rest.upper_rad;
    for side in Side::BOTH {
        for (i, rad, mirrored) in FORWARD {
            forward_rad[ARM_COLUMNS[side] + i] = if mirrored { side.sign() * rad } else { rad };
        }
    }
    let mut fastest = 0.0f32;
    for step in 0..((RAISED_S + 6.0 * JUMPS_S) / CONTROL_DT_S) as u32 {
        let time_s = step as f32 * CONTROL_DT_S;
        let raised = (time_s / RAISED_S).min(1.0);
        let mut upper_rad = rest.upper_rad;
        for (target_rad, forward_rad) in upper_rad.iter_mut().zip(forward_rad) {
            *target_rad += raised * (forward_rad - *target_rad);
        }
        if time_s > RAISED_S {
            let up = (((time_s - RAISED_S) / JUMPS_S) as u32).is_multiple_of(2);
            upper_rad[column] = if up { joint.upper_rad } else { joint.lower_rad };
        }
        let robot =
            world.control_step(&[RobotCommand { upper_rad, base: rest.base }]).unwrap().robots.remove(0);
        if time_s > RAISED_S {
            let speed_rad_s = robot.sensed.joints.qd_rad_s[UPPER[column]].abs();
            fastest = fastest.max(speed_rad_s / joint.speed_limit_rad_s);
        }
    }
    fastest
}

/// Joints of arms and hands, one at a time: swings and blows may turn joints faster, but no motor does.
#[test]
fn no_motor_turns_its_joint_faster_than_it_can() {
    let mut fast = 0;
    for column in (0..UPPER_JOINTS).filter(|column| *column < WAIST_COLUMN) {
        let share = fastest_share(column);
        println!("column {column}: {share}");
        assert!(share < 1.01, "column {column}: {share}");
        fast += u32::from(share > 0.95);
    }
    assert!(fast >= 20, "only {fast} joints came near their motors' speeds");
}

/// Returns setpoints that hold the joints at `q_rad`, with gains as LeRobot sends them.
fn holding(q_rad: [f32; JOINTS]) -> MotorSetpoints {
    let gains = |joint: usize| match joint {
        3 | 9 => [300.0, 4.0],
        0..12 => [150.0, 2.0],
        12..15 => [250.0, 5.0],
        22..29 | 36..43 => [2.0, 0.06],
        _ => [80.0, 3.0],
    };
    let [kp_n_m_rad, kd_n_m_s_rad] = [0, 1].map(|gain| std::array::from_fn(|joint| gains(joint)[gain]));
    MotorSetpoints { q_rad, kp_n_m_rad, kd_n_m_s_rad, ..MotorSetpoints::LIMP }
}

/// Runs control steps with setpoints. Returns true if the robot has fallen.
fn driven(world: &mut World, setpoints: &[MotorSetpoints], control_steps: u32) -> bool {
    let command = world.rest_command(0);
    let mut fallen = false;
    for _ in 0..control_steps {
        world.drive_motors(0, setpoints);
        fallen = world.control_step(&[command]).unwrap().robots[0].truth.fallen;
    }
    fallen
}

#[test]
fn motors_exert_what_their_setpoints_say() {
    let mut world = on_floor();
    let mut last = world.robots()[0].readings().last().unwrap().clone();
    let joints = world.robots()[0].model.joints.clone();
    for step in 0..25 {
        let mut setpoints = vec![holding(last.joints.q_rad); 4];
        for (substep, setpoints) in setpoints.iter_mut().enumerate() {
            setpoints.q_rad[18] += 0.02 * (substep as f32 + 1.0);
            setpoints.qd_rad_s[18] = 0.5;
            setpoints.torque_n_m[14] = if step % 2 == 0 { 4.0 } else { -4.0 };
        }
        driven(&mut world, &setpoints, 1);
        let readings = world.robots()[0].readings();
        assert_eq!(readings.len(), 4);
        for (setpoints, now) in setpoints.iter().zip(readings) {
            for (joint, model) in joints.iter().enumerate() {
                let explicit = model.armature_kg_m2 / (PHYSICS_DT_S * PHYSICS_DT_S);
                assert!(setpoints.kp_n_m_rad[joint] <= explicit, "the whole spring is explicit");
                let told_n_m = setpoints.torque_n_m[joint]
                    + setpoints.kp_n_m_rad[joint] * (setpoints.q_rad[joint] - last.joints.q_rad[joint])
                    + setpoints.kd_n_m_s_rad[joint]
                        * (setpoints.qd_rad_s[joint] - now.joints.qd_rad_s[joint]);
                let limit_n_m = model.effort_n_m;
                let off_n_m = (now.joints.torque_n_m[joint] - told_n_m.clamp(-limit_n_m, limit_n_m)).abs();
                assert!(off_n_m < 0.01, "step {step}, {}: {off_n_m} N m", model.name);
            }
            last = now.clone();
        }
    }
}

#[test]
fn a_limp_robot_falls_and_one_that_is_handed_back_stands() {
    let mut world = on_floor();
    assert!(driven(&mut world, &[MotorSetpoints::LIMP], 100), "nothing holds it");
    let mut world = on_floor();
    let q_rad = world.present().robots[0].sensed.joints.q_rad;
    assert!(!driven(&mut world, &[holding(q_rad)], 15));
    let command = world.rest_command(0);
    for _ in 0..150 {
        let step = world.control_step(&[command]).unwrap();
        assert!(!step.robots[0].truth.fallen);
    }
    let speed_rad_s = world.present().robots[0].sensed.joints.qd_rad_s;
    assert!(speed_rad_s[..12].iter().all(|speed| speed.abs() < 0.2), "it stands: {speed_rad_s:?}");
}

#[test]
fn driven_motors_go_the_same_way_again() {
    let mut world = on_floor();
    let q_rad = world.present().robots[0].sensed.joints.q_rad;
    driven(&mut world, &[holding(q_rad)], 10);
    let kept = world.snapshot().unwrap();
    let on = |world: &mut World| {
        driven(world, &[holding(q_rad)], 10);
        let command = world.rest_command(0);
        world.control_step(&[command]).unwrap();
        world.state_hash()
    };
    let first = on(&mut world);
    world.restore(&kept).unwrap();
    assert_eq!(first, on(&mut world));
}
