//! Two robots, a counter and a bottle: standing, following commands, repeating bit for bit.

use std::f32::consts::PI;

use tandem_sim::{
    CONTROL_DT_S, ObjectPlacement, Pose, RobotCommand, RobotPlacement, SimError, Vector, World, WorldSpec,
};

fn kitchen() -> WorldSpec {
    let robot = |name: &str, x: f32, y: f32, yaw_rad: f32| RobotPlacement {
        name: name.into(),
        position_m: [x, y],
        yaw_rad,
    };
    WorldSpec {
        scene: "kitchen_084".into(),
        robots: vec![robot("A", 0.0, 0.0, 0.0), robot("B", 0.74, -0.12, PI)],
        objects: vec![ObjectPlacement {
            name: "bottle".into(),
            file: "bottle".into(),
            world_from_object: Pose::from_translation(Vector::new(0.30, -0.07, 0.80)),
        }],
    }
}

fn world() -> World {
    World::new(&kitchen()).expect("embedded files load")
}

/// Commands that let both robots wave their arms in front of them, by control step.
fn waving(rest: &[RobotCommand], step: u64) -> Vec<RobotCommand> {
    let time_s = step as f32 * CONTROL_DT_S;
    let wave = |joint: usize, robot: usize| {
        0.3 * (2.5 * time_s + joint as f32 + robot as f32).sin() * time_s.min(1.0)
    };
    let mut commands = rest.to_vec();
    for (robot, command) in commands.iter_mut().enumerate() {
        // Shoulder pitch and elbow of both arms: they swing in front of the body and touch nothing.
        for joint in [0, 3, 7, 10] {
            command.upper_rad[joint] += wave(joint, robot);
        }
    }
    commands
}

fn rest(world: &World) -> Vec<RobotCommand> {
    (0..world.robots().len()).map(|robot| world.rest_command(robot)).collect()
}

fn run(world: &mut World, rest: &[RobotCommand], steps: u64) {
    for _ in 0..steps {
        world.control_step(&waving(rest, world.control_steps()));
    }
}

#[test]
fn robots_stand_while_their_arms_move() {
    let mut world = world();
    let rest = rest(&world);
    let (mut low, mut high) = (Vector::INFINITY, Vector::NEG_INFINITY);
    for _ in 0..500 {
        run(&mut world, &rest, 1);
        let state = world.robot_state(0);
        low = low.min(state.world_from_pelvis.translation);
        high = high.max(state.world_from_pelvis.translation);
        for (torque_n_m, joint) in state.torque_n_m.iter().zip(&world.robots()[0].model.joints) {
            assert!(torque_n_m.abs() <= joint.effort_n_m, "{} needs {torque_n_m} N m", joint.name);
        }
        assert_eq!(world.self_contacts(0), []);
    }
    let sway = high - low;
    assert!(sway.x < 0.015 && sway.y < 0.015 && sway.z < 0.005, "pelvis sways {sway} m");
    assert!(!world.robot_state(0).fallen && !world.robot_state(1).fallen);
}

#[test]
fn height_command_is_followed_without_drift() {
    let mut world = world();
    let mut commands = rest(&world);
    let start = world.robot_state(0).world_from_pelvis.translation;
    for (height_m, steps) in [(0.60, 200), (0.74, 200)] {
        commands[0].base.pelvis_height_m = height_m;
        (0..steps).for_each(|_| drop(world.control_step(&commands)));
        let pelvis = world.robot_state(0).world_from_pelvis.translation;
        assert!((pelvis.z - height_m).abs() < 0.02, "asked for {height_m} m, stands at {} m", pelvis.z);
    }
    let end = world.robot_state(0).world_from_pelvis.translation;
    assert!((end.x - start.x).abs() < 0.01 && (end.y - start.y).abs() < 0.01, "from {start} to {end}");
}

#[test]
fn bottle_rests_where_it_was_put() {
    let mut world = world();
    let commands = rest(&world);
    let start = kitchen().objects[0].world_from_object.translation;
    for _ in 0..500 {
        world.control_step(&commands);
    }
    let state = world.object("bottle").expect("it is in the world");
    let drift_m = (state.world_from_object.translation - start).length();
    assert!(drift_m < 0.002, "drifted {drift_m} m");
    assert!(state.velocity_m_s.length() < 0.01);
}

#[test]
fn equal_commands_give_equal_hashes_and_other_commands_do_not() {
    let (mut first, mut second) = (world(), world());
    let rest = rest(&first);
    run(&mut first, &rest, 60);
    run(&mut second, &rest, 60);
    assert_eq!(first.state_hash(), second.state_hash());
    first.control_step(&rest);
    second.control_step(&waving(&rest, 61));
    assert_ne!(first.state_hash(), second.state_hash());
}

#[test]
fn a_restored_world_continues_bit_for_bit() {
    let mut original = world();
    let rest = rest(&original);
    run(&mut original, &rest, 40);
    let snapshot = original.snapshot().expect("worlds can be saved");
    run(&mut original, &rest, 60);

    let mut continued = world();
    continued.restore(&snapshot).expect("the same binary reads it");
    assert_eq!(continued.control_steps(), 40);
    run(&mut continued, &rest, 60);
    assert_eq!(continued.state_hash(), original.state_hash());
}

#[test]
fn unknown_files_are_named_with_what_there_is() {
    let scene = World::new(&WorldSpec { scene: "kitchen".into(), ..kitchen() }).err();
    let message = scene.map(|error| error.to_string()).unwrap_or_default();
    assert!(message.contains("no scene `kitchen`; have: ") && message.contains("kitchen_084"), "{message}");

    let mut spec = kitchen();
    spec.objects[0].file = "botle".into();
    assert!(matches!(World::new(&spec), Err(SimError::UnknownAsset { kind: "object", .. })));
}
