//! Falling: robots go limp, and the floor has no edge.

use std::sync::Arc;

use tandem_sim::mjcf::Document;
use tandem_sim::{ObjectPlacement, Pose, RobotPlacement, SceneSource, Vector, World, WorldSpec};

fn robot(position_m: [f32; 2]) -> RobotPlacement {
    RobotPlacement { name: "A".into(), position_m, yaw_rad: 0.0 }
}

#[test]
fn the_legs_of_a_fallen_robot_are_limp() {
    let spec = WorldSpec { scene: "floor".into(), robots: vec![robot([0.0, 0.0])], objects: vec![] };
    let mut world = World::new(&spec).expect("a world");
    let command = [world.rest_command(0)];
    let (mut fell, mut checked) = (false, 0);
    for control_step in 0..200 {
        if control_step < 20 {
            world.push(0, "torso_link", Vector::new(0.0, 0.0, 0.2), Vector::new(400.0, 0.0, 0.0));
        }
        let step = world.control_step(&command).expect("it stays finite");
        let robot = &step.robots[0];
        // Spurious energy of a faster robot is removed after its drives have acted.
        if fell && robot.sensed.joints.qd_rad_s.iter().all(|speed| speed.abs() < 8.0) {
            checked += 1;
            let model = &world.robots()[0].model;
            for (index, joint) in model.joints.iter().enumerate().take(12) {
                let (torque_n_m, velocity) =
                    (robot.sensed.joints.torque_n_m[index], robot.sensed.joints.qd_rad_s[index]);
                let damper_n_m = -joint.kd_n_m_s_rad * velocity;
                assert!(
                    (torque_n_m - damper_n_m).abs() < 0.01,
                    "{}: {torque_n_m} {damper_n_m} N m",
                    joint.name
                );
            }
        }
        fell = robot.truth.fallen;
    }
    assert!(checked > 50, "{checked} steps were looked at");
    let step = world.present();
    let sensed = &step.robots[0].sensed;
    assert!(fell && sensed.joints.qd_rad_s.iter().all(|speed| speed.abs() < 0.5), "it lies still");
    let arm_rad = sensed.joints.q_rad[15] - command[0].upper_rad[0];
    assert!(arm_rad.abs() < 0.6, "its arm still does what it is told: {arm_rad} rad away");
}

/// The floor of home_098 is drawn to y = -2 m. A robot placed beyond stands, and so does a bottle.
#[test]
fn floors_go_on_where_they_are_no_longer_drawn() {
    let bottle = ObjectPlacement {
        name: "bottle".into(),
        file: "bottle".into(),
        world_from_object: Pose::from_translation(Vector::new(60.0, -90.0, 0.1)),
    };
    let spec =
        WorldSpec { scene: "home_098".into(), robots: vec![robot([0.0, -6.0])], objects: vec![bottle] };
    let mut world = World::new(&spec).expect("a world");
    let mut command = [world.rest_command(0)];
    command[0].base.vx_m_s = 0.2;
    for _ in 0..250 {
        world.control_step(&command).expect("it stays finite");
    }
    let step = world.present();
    assert!(!step.robots[0].truth.fallen);
    let bottle_m = step.object("bottle").expect("a bottle").world_from_object.translation;
    assert!(bottle_m.z.abs() < 0.05, "{bottle_m}");
}

/// A scene without colliders has a ground nevertheless, on which robots stand.
#[test]
fn robots_stand_in_a_scene_of_nothing() {
    let ghost = r#"<geom type="box" size="1 1 1" pos="4 0 -5" contype="0" conaffinity="0"/>"#;
    for room in ["", ghost] {
        let xml = format!("<mujoco><worldbody>{room}</worldbody></mujoco>");
        let document = Arc::new(Document::parse("room.xml", &xml).expect("a room"));
        let spec = WorldSpec {
            scene: SceneSource::Read { document, world_from_scene: Pose::IDENTITY },
            robots: vec![robot([0.0, 0.0])],
            objects: vec![],
        };
        let mut world = World::new(&spec).expect("a world");
        let command = [world.rest_command(0)];
        for _ in 0..100 {
            world.control_step(&command).expect("it stays finite");
        }
        let robot = &world.present().robots[0];
        assert!(!robot.truth.fallen && robot.truth.world_from_pelvis().translation.z > 0.7, "{room}");
    }
}

/// A floor that is a box ends, but an object that goes over its edge comes to rest on a ground below.
#[test]
fn what_goes_over_the_edge_of_a_box_lands_below_it() {
    let bottle = |name: &str, x_m: f32| ObjectPlacement {
        name: name.into(),
        file: "bottle".into(),
        world_from_object: Pose::from_translation(Vector::new(x_m, 0.5, 0.02)),
    };
    let floor = r#"<geom type="box" size="2 1 0.05" pos="0 0 -0.05"/>"#;
    let plane = r#"<geom type="plane" size="1 1 0.1" pos="0 0 -0.3"/>"#;
    let lamp = r#"<geom type="box" size="0.1 0.1 0.1" pos="0 0 2.5"/>"#;
    let door = r#"<body name="door" pos="0 0.9 1"><joint axis="0 0 1"/><geom type="box" size="0.3 0.02 0.8"/></body>"#;
    let raft = r#"<body name="raft" pos="0 0 -0.05"><freejoint/><geom type="box" size="2 1 0.05"/></body>"#;
    let rooms = [
        (floor.to_string(), -0.1),
        (format!("{floor}{plane}"), -0.3),
        (format!("{lamp}<body name=\"house\">{floor}{door}</body>"), -0.1),
        (format!("{lamp}<body name=\"house\">{floor}{plane}{door}</body>"), -0.3),
        (raft.to_string(), -0.1),
    ];
    for (room, ground_m) in rooms {
        let xml = format!("<mujoco><worldbody>{room}</worldbody></mujoco>");
        let document = Arc::new(Document::parse("room.xml", &xml).expect("a room"));
        let spec = WorldSpec {
            scene: SceneSource::Read { document, world_from_scene: Pose::IDENTITY },
            robots: vec![robot([0.0, 0.0])],
            objects: vec![bottle("on", 1.5), bottle("beside", 3.0)],
        };
        let mut world = World::new(&spec).expect("a world");
        let command = [world.rest_command(0)];
        for _ in 0..100 {
            world.control_step(&command).expect("it stays finite");
        }
        let step = world.present();
        assert!(!step.robots[0].truth.fallen);
        for (name, expected_m) in [("on", 0.0), ("beside", ground_m)] {
            let bottle_m = step.object(name).expect("a bottle").world_from_object.translation;
            // It may have tipped over.
            assert!((bottle_m.z - expected_m).abs() < 0.05, "{name}: {bottle_m} in {room}");
        }
    }
}

/// A floor carries a mesh, wherever the frame of its vertices is.
#[test]
fn a_mesh_far_from_its_frame_lies_on_the_floor() {
    let corners = [59.9, 60.1].map(|x| format!("{x} -0.1 -0.1  {x} 0.1 -0.1  {x} -0.1 0.1  {x} 0.1 0.1"));
    let xml = format!(
        r#"<mujoco><asset><mesh name="cube" vertex="{}"/></asset><worldbody><geom type="plane" size="1 1 0.1"/>
        <body name="cube" pos="-60 0 0.2"><freejoint/><geom type="mesh" mesh="cube"/></body></worldbody></mujoco>"#,
        corners.join(" ")
    );
    let document = Arc::new(Document::parse("cube.xml", &xml).expect("a scene"));
    let scene = SceneSource::Read { document, world_from_scene: Pose::IDENTITY };
    let mut world = World::new(&WorldSpec { scene, robots: vec![], objects: vec![] }).expect("a world");
    for _ in 0..50 {
        world.control_step(&[]).expect("it stays finite");
    }
    let frame_m = world.present().object("cube").expect("a cube").world_from_object.translation;
    assert!((frame_m.z - 0.1).abs() < 0.02, "{frame_m}");
}
