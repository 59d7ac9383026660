//! Maximum speed of motors, whatever the command.

use tandem_sim::{
    ARM_COLUMNS, CONTROL_DT_S, RobotCommand, RobotPlacement, Side, UPPER, UPPER_JOINTS, WAIST_COLUMN, World,
    WorldSpec,
};

/// Shoulder pitch, roll and elbow, which hold the hands away from the body.
const FORWARD: [(usize, f32, bool); 3] = [(0, -0.35, false), (1, 0.5, true), (3, 0.3, false)];
const RAISED_S: f32 = 1.5;
const JUMPS_S: f32 = 0.3;

/// Returns the greatest speed of a joint, as a share of its motor's, when its target jumps from one end
/// of its range to the other and back.
fn fastest_share(column: usize) -> f32 {
    let placement = RobotPlacement { name: "A".into(), position_m: [0.0; 2], yaw_rad: 0.0 };
    let spec = WorldSpec { scene: "floor".into(), robots: vec![placement], objects: vec![] };
    let mut world = World::new(&spec).unwrap();
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
