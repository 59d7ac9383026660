//! Two robots, a counter and a bottle: standing, following commands, repeating bit for bit.

use std::f32::consts::PI;
use std::sync::Arc;

use tandem_sim::body::RobotModel;
use tandem_sim::{
    BodyTouch, CONTROL_DT_S, HandContacts, ObjectPlacement, Pose, RobotCommand, RobotPlacement, Side,
    SimError, Step, Vector, World, WorldSpec, assets,
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

/// Returns the commands of two robots that wave their arms in front of their bodies, by control step.
fn waving(rest: &[RobotCommand], step: u64) -> Vec<RobotCommand> {
    let time_s = step as f32 * CONTROL_DT_S;
    let wave = |joint: usize, robot: usize| {
        0.3 * (2.5 * time_s + joint as f32 + robot as f32).sin() * time_s.min(1.0)
    };
    let mut commands = rest.to_vec();
    for (robot, command) in commands.iter_mut().enumerate() {
        // Shoulder pitch and elbow of both arms: they swing in front of the body without contacts.
        for joint in [0, 3, 7, 10] {
            command.upper_rad[joint] += wave(joint, robot);
        }
    }
    commands
}

fn rest(world: &World) -> Vec<RobotCommand> {
    (0..world.robots().len()).map(|robot| world.rest_command(robot)).collect()
}

/// Runs several waving steps and returns the last one.
fn run(world: &mut World, rest: &[RobotCommand], steps: u64) -> Step {
    let mut step = world.present();
    for _ in 0..steps {
        step = world.control_step(&waving(rest, step.control_step)).expect("it stays finite");
    }
    step
}

fn pelvis_m(step: &Step, robot: usize) -> Vector {
    step.robots[robot].truth.world_from_pelvis().translation
}

#[test]
fn robots_stand_while_their_arms_move() {
    let mut world = world();
    let rest = rest(&world);
    let (mut low, mut high) = (Vector::INFINITY, Vector::NEG_INFINITY);
    for _ in 0..500 {
        let step = run(&mut world, &rest, 1);
        low = low.min(pelvis_m(&step, 0));
        high = high.max(pelvis_m(&step, 0));
        let torques_n_m = step.robots[0].sensed.joints.torque_n_m;
        for (torque_n_m, joint) in torques_n_m.iter().zip(&world.robots()[0].model.joints) {
            assert!(torque_n_m.abs() <= joint.effort_n_m, "{} needs {torque_n_m} N m", joint.name);
        }
        assert_eq!(world.self_contacts(0), []);
        assert!(step.robots.iter().all(|robot| !robot.truth.fallen));
    }
    let sway = high - low;
    assert!(sway.x < 0.015 && sway.y < 0.015 && sway.z < 0.005, "pelvis sways {sway} m");
}

/// A robot is defined by its file: one with a torso of 10 kg stands and waves without any other code.
#[test]
fn another_robots_file_is_all_it_takes() {
    let ours = assets::robot(assets::DEFAULT_ROBOT).expect("embedded");
    let other = ours.replacen("mass=\"7.818\"", "mass=\"10\"", 1);
    assert_ne!(ours, other);
    let mass_kg = |text: &str| RobotModel::parse("robot.xml", text).expect("a robot").mass_kg;
    let heavier_kg = mass_kg(&other) - mass_kg(ours);
    assert!((heavier_kg - 2.182).abs() < 1e-3, "{heavier_kg} kg");
    let model = Arc::new(RobotModel::parse("robot.xml", &other).expect("a robot"));
    let mut world = World::with_robot(&kitchen(), model).expect("a world");
    let rest = rest(&world);
    let step = run(&mut world, &rest, 200);
    assert!(step.robots.iter().all(|robot| !robot.truth.fallen));
}

#[test]
fn height_command_is_followed_without_drift() {
    let mut world = world();
    let mut commands = rest(&world);
    let start = pelvis_m(&world.present(), 0);
    // At 0.60 m both hands come down on the counter, and push the robot back.
    for (height_m, steps) in [(0.60, 400), (0.74, 200)] {
        commands[0].base.pelvis_height_m = height_m;
        (0..steps).for_each(|_| drop(world.control_step(&commands).expect("it stays finite")));
        let pelvis = pelvis_m(&world.present(), 0);
        assert!((pelvis.z - height_m).abs() < 0.02, "asked for {height_m} m, stands at {} m", pelvis.z);
        let off_m = pelvis - start;
        assert!(off_m.x.abs() < 0.01 && off_m.y.abs() < 0.01, "at {height_m} m from {start} to {pelvis}");
    }
}

#[test]
fn bottle_rests_where_it_was_put() {
    let mut world = world();
    let commands = rest(&world);
    let start = kitchen().objects[0].world_from_object.translation;
    for _ in 0..500 {
        world.control_step(&commands).expect("it stays finite");
    }
    let step = world.present();
    let state = step.object("bottle").expect("it is in the world");
    let drift_m = (state.world_from_object.translation - start).length();
    assert!(drift_m < 0.002, "drifted {drift_m} m");
    assert!(state.velocity_m_s.length() < 0.01);
    assert_eq!(step.touches, [], "nobody is near it");
}

#[test]
fn a_step_says_what_was_done_and_comes_back_from_its_bytes() {
    let mut world = world();
    let commands = waving(&rest(&world), 5);
    let first = world.present();
    assert_eq!((first.control_step, first.time_s), (0, 0.0));
    let at_rest: Vec<RobotCommand> = first.robots.iter().map(|robot| robot.command).collect();
    assert_eq!(at_rest, rest(&world));

    let step = world.control_step(&commands).expect("it stays finite");
    assert_eq!((step.control_step, step.time_s), (1, 0.02));
    let executed: Vec<RobotCommand> = step.robots.iter().map(|robot| robot.command).collect();
    assert_eq!(executed, commands);
    let bytes = postcard::to_stdvec(&step).expect("a step is plain");
    assert_eq!(postcard::from_bytes::<Step>(&bytes).expect("it was just written"), alone(step));
}

/// Returns a step without the poses of the previous step, which neither its bytes nor snapshots contain.
fn alone(mut step: Step) -> Step {
    step.robots.iter_mut().for_each(|robot| robot.truth.world_from_camera_before = None);
    step
}

#[test]
fn a_step_names_the_hand_that_touches() {
    let right_wrist = {
        let robot = &world().present().robots[0];
        robot.truth.world_from_pelvis() * robot.sensed.pelvis_from_wrist.right
    };
    let mut spec = kitchen();
    // The bottle falls onto the hand.
    let in_hand_m = right_wrist * Vector::new(0.09, 0.0, 0.0);
    spec.objects[0].world_from_object = Pose::from_translation(in_hand_m);
    let mut world = World::new(&spec).expect("embedded files load");
    let rest = rest(&world);
    let mut steps = (0..50).map(|_| world.control_step(&rest).expect("it stays finite"));
    let step = steps.find(|step| !step.touches.is_empty()).expect("the bottle lands on the hand");
    let hands: Vec<_> = step.touches.iter().map(|touch| (touch.robot, touch.side, touch.object)).collect();
    assert_eq!(hands, [(0, Side::Right, 0)]);
    assert_eq!(step.contacts(0, Side::Right, "bottle"), step.touches[0].contacts);
    assert_eq!(step.contacts(0, Side::Left, "bottle"), HandContacts::default());
    assert_eq!(step.contacts(0, Side::Right, "vase"), HandContacts::default());
    assert_eq!(step.body_touches, [BodyTouch { object: 0, robot: 0 }]);
    assert!(step.is_touched("bottle") && !step.is_touched("vase"));
}

#[test]
fn a_step_names_the_robot_that_touches_with_what_is_no_hand() {
    let mut spec = kitchen();
    // The bottle falls onto A's left shoulder, far from all hands.
    spec.objects[0].world_from_object = Pose::from_translation(Vector::new(0.0, 0.12, 1.15));
    let mut world = World::new(&spec).expect("embedded files load");
    let rest = rest(&world);
    let mut steps = (0..50).map(|_| world.control_step(&rest).expect("it stays finite"));
    let step = steps.find(|step| !step.body_touches.is_empty()).expect("the bottle lands on the shoulder");
    assert_eq!(step.body_touches, [BodyTouch { object: 0, robot: 0 }]);
    assert!(step.touches.is_empty() && step.is_touched("bottle"));
}

#[test]
fn equal_commands_give_equal_hashes_and_other_commands_do_not() {
    let (mut first, mut second) = (world(), world());
    let rest = rest(&first);
    run(&mut first, &rest, 60);
    run(&mut second, &rest, 60);
    assert_eq!(first.state_hash(), second.state_hash());
    first.control_step(&rest).expect("it stays finite");
    second.control_step(&waving(&rest, 61)).expect("it stays finite");
    assert_ne!(first.state_hash(), second.state_hash());
}

#[test]
fn a_restored_world_continues_bit_for_bit() {
    let mut original = world();
    let rest = rest(&original);
    let saved = run(&mut original, &rest, 40);
    let snapshot = original.snapshot().expect("worlds can be saved");
    run(&mut original, &rest, 60);

    let mut continued = world();
    continued.restore(&snapshot).expect("the same binary reads it");
    assert_eq!(continued.present(), alone(saved));
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
