//! A robot's own odometry against its true motion.

use tandem_sim::{BaseCommand, Pose, RobotCommand, RobotPlacement, RobotStep, World, WorldSpec};

fn world() -> World {
    let robot = RobotPlacement { name: "A".into(), position_m: [0.4, -0.3], yaw_rad: 1.1 };
    let spec = WorldSpec { scene: "floor".into(), robots: vec![robot], objects: vec![] };
    World::new(&spec).expect("embedded files load")
}

fn pelvis(world: &World) -> RobotStep {
    world.present().robots.remove(0)
}

/// Returns the errors of the odometry in place and heading after a walk of `seconds` that ends at rest,
/// and the length of the walk.
fn drift(velocity: [f32; 3], seconds: u32) -> ([f32; 2], f32) {
    let mut world = world();
    let rest = world.rest_command(0);
    let mut start = pelvis(&world).truth.world_from_pelvis();
    start.translation.z = 0.0;
    let [vx_m_s, vy_m_s, yaw_rate_rad_s] = velocity;
    let walk = BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, ..rest.base };
    let mut way_m = 0.0;
    let mut last_m = start.translation;
    for base in [vec![walk; 50 * seconds as usize], vec![rest.base; 150]].concat() {
        let step = world.control_step(&[RobotCommand { base, ..rest }]).expect("it stays finite");
        let pelvis_m = step.robots[0].truth.world_from_pelvis().translation;
        way_m += (pelvis_m - last_m).truncate().length();
        last_m = pelvis_m;
    }
    let RobotStep { sensed, truth, .. } = pelvis(&world);
    assert!(!truth.fallen, "{velocity:?}");
    let off: Pose = (start.inverse() * truth.world_from_pelvis()).inverse() * sensed.start_from_pelvis;
    let turned_rad = 2.0 * off.rotation.xyz().length().asin();
    ([off.translation.length(), turned_rad], way_m)
}

#[test]
fn drift_is_what_the_book_says() {
    for velocity in [
        [0.4, 0.0, 0.0],
        [0.2, 0.0, 0.0],
        [-0.3, 0.0, 0.0],
        [0.0, 0.3, 0.0],
        [0.0, -0.3, 0.0],
        [0.0, 0.0, 0.5],
        [0.3, 0.1, 0.3],
        [-0.2, -0.1, -0.4],
    ] {
        let ([off_m, off_rad], way_m) = drift(velocity, 10);
        assert!(off_m < 0.005 + 0.01 * way_m, "{velocity:?}: {off_m} m off after {way_m} m");
        assert!(off_rad < 0.005, "{velocity:?}: {off_rad} rad off");
    }
}

#[test]
fn a_standing_robot_stays_where_it_is() {
    let ([off_m, off_rad], _) = drift([0.0; 3], 57);
    assert!(off_m < 0.002 && off_rad < 0.001, "{off_m} m, {off_rad} rad off after a minute");
}

#[test]
fn a_snapshot_keeps_the_way() {
    let mut world = world();
    let rest = world.rest_command(0);
    let walk = RobotCommand { base: BaseCommand { vx_m_s: 0.3, yaw_rate_rad_s: 0.2, ..rest.base }, ..rest };
    let go = |world: &mut World| (0..100).for_each(|_| drop(world.control_step(&[walk]).expect("finite")));
    let told = |world: &World| pelvis(world).sensed.start_from_pelvis;
    go(&mut world);
    let snapshot = world.snapshot().expect("a snapshot");
    let then = told(&world);
    assert!(then.translation.truncate().length() > 0.2, "it has walked: {then:?}");
    go(&mut world);
    let later = told(&world);
    world.restore(&snapshot).expect("its own snapshot");
    assert_eq!(told(&world), then);
    go(&mut world);
    assert_eq!(told(&world), later);
}
