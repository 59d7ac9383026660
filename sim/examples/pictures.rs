//! Times two egocentric pictures of one state, over and over, and says how long they kept the processor busy.
//!
//! `cargo build --release --workspace --examples; target/release/examples/pictures 30` times 30 states of the kitchen.

use std::f32::consts::PI;
use std::time::{Duration, Instant};

use tandem_sim::render::{Cameras, Scenery, cpu};
use tandem_sim::{ObjectPlacement, Pose, RobotPlacement, SimError, Vector, World, WorldSpec};

const STATES: u32 = 20;
/// Time that this thread has been running, in nanoseconds, is the first word of this file of Linux.
const BUSY: &str = "/proc/thread-self/schedstat";

fn main() -> Result<(), SimError> {
    let states = std::env::args().nth(1).and_then(|count| count.parse().ok()).unwrap_or(STATES);
    let mut world = World::new(&kitchen())?;
    let commands = [world.rest_command(0), world.rest_command(1)];
    let cameras = Cameras::of(&world);
    let mut renderer = cpu(Scenery::of(&world));
    let (mut drawing, started) = (Duration::ZERO, Instant::now());
    for _ in 0..states {
        let step = world.control_step(&commands).expect("it stays finite");
        let before = busy(started);
        for robot in 0..2 {
            let frame = renderer.render(&step, &cameras.egocentric(&step, robot));
            assert_eq!((frame.width, frame.height), (320, 240));
        }
        drawing += busy(started) - before;
    }
    println!(
        "two pictures of one state: {:.2} ms, mean of {states} states",
        drawing.as_secs_f64() * 1e3 / f64::from(states)
    );
    Ok(())
}

/// Processor time of this thread; where the system does not tell, the time since `started`.
fn busy(started: Instant) -> Duration {
    let text = std::fs::read_to_string(BUSY).unwrap_or_default();
    let ns = text.split_whitespace().next().and_then(|word| word.parse().ok());
    ns.map_or_else(|| started.elapsed(), Duration::from_nanos)
}

fn kitchen() -> WorldSpec {
    let robot = |name: &str, position_m: [f32; 2], yaw_rad: f32| RobotPlacement {
        name: name.into(),
        position_m,
        yaw_rad,
    };
    WorldSpec {
        scene: "kitchen_084".into(),
        robots: vec![robot("A", [0.0, 0.0], 0.0), robot("B", [0.74, -0.12], PI)],
        objects: vec![ObjectPlacement {
            name: "bottle".into(),
            file: "bottle".into(),
            world_from_object: Pose::from_translation(Vector::new(0.30, -0.07, 0.80)),
        }],
    }
}
