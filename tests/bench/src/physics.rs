//! Computation time of a physics step of 5 ms for robots in Handover's kitchen that stand, walk, or hold a
//! bottle each. `tests/peers/simulation/physics_timing.py` steps the same situations in MuJoCo.

use std::f32::consts::PI;
use std::time::{Duration, Instant};

use serde::Serialize;
use tandem_sim::body::{HAND_COLUMNS, HAND_JOINTS};
use tandem_sim::{
    ObjectPlacement, PHYSICS_DT_S, PHYSICS_STEPS_PER_CONTROL, Pose, RobotCommand, RobotPlacement, SimError,
    Vector, World, WorldSpec,
};

use crate::error::BenchError;
use crate::spread::Spread;

/// Median times of all situations.
#[derive(Clone, Debug, Serialize)]
pub struct PhysicsReport {
    pub cases: Vec<PhysicsCase>,
}

#[derive(Clone, Debug, Serialize)]
pub struct PhysicsCase {
    pub name: &'static str,
    pub robots: usize,
    /// Time for collision detection and dynamics in one physics step.
    #[serde(rename = "step_us_median")]
    pub median_step_us: f64,
    #[serde(rename = "step_us_quartiles")]
    pub quartiles_step_us: [f64; 2],
    /// Ratio of simulated time to the wall-clock time of physics, sensing and the robots' controllers
    /// together.
    pub realtime_factor: f64,
}

#[derive(Clone, Copy, PartialEq)]
enum Situation {
    Standing,
    Walking,
    Holding,
}

const MAX_ROBOTS: usize = 3;
const ROUNDS: usize = 3;
/// Number of control steps in which robots come to rest, or reach a steady gait.
const SETTLING_CONTROL_STEPS: usize = 75;
const CONTROL_STEPS: usize = 150;
/// Number of control steps in which the fingers partly close before the bottle is placed between them.
const CLOSING_CONTROL_STEPS: usize = 25;
const NEARLY: f32 = 0.8;
/// Joint targets of a right hand closed round an upright cylinder of 7 cm: thumb 0 to 2, middle finger 0 and
/// 1, index finger 0 and 1.
const CLOSED_RAD: [f32; HAND_JOINTS] = [0.0, 0.75, -0.8, 1.1, 1.3, 1.1, 1.3];
/// Middle of the grasped cylinder in the frame of the wrist, and the grasp height above a bottle's base.
const GRASP_IN_WRIST_M: Vector = Vector::new(0.12, 0.055, 0.0);
const HELD_AT_M: f32 = 0.1;
/// Forward velocity; negative, so robots walk away from the counter and from each other.
const WALKING_M_S: f32 = -0.2;

/// Measures every situation with one to three robots. Calls `done` after each.
///
/// # Errors
///
/// Returns an error if a world cannot be built or physics diverges.
pub fn physics(mut done: impl FnMut(&PhysicsCase)) -> Result<PhysicsReport, BenchError> {
    let mut cases = Vec::new();
    for situation in [Situation::Standing, Situation::Walking, Situation::Holding] {
        for robots in 1..=MAX_ROBOTS {
            let case = measure(situation, robots)?;
            done(&case);
            cases.push(case);
        }
    }
    Ok(PhysicsReport { cases })
}

fn measure(situation: Situation, robots: usize) -> Result<PhysicsCase, SimError> {
    let mut steps: Vec<Duration> = Vec::new();
    let mut whole: Vec<Duration> = Vec::new();
    for _ in 0..ROUNDS {
        let (mut world, commands) = begin(situation, robots)?;
        for control_step in 0..SETTLING_CONTROL_STEPS + CONTROL_STEPS {
            let started = Instant::now();
            let mut within = Vec::with_capacity(PHYSICS_STEPS_PER_CONTROL as usize);
            for substep in 0..PHYSICS_STEPS_PER_CONTROL {
                world.drive(&commands, substep);
                let stepped = Instant::now();
                world.advance()?;
                within.push(stepped.elapsed());
                world.sense();
            }
            if control_step >= SETTLING_CONTROL_STEPS {
                whole.push(started.elapsed() / PHYSICS_STEPS_PER_CONTROL);
                steps.append(&mut within);
            }
        }
        check(&world, situation);
    }
    let [step_us, whole_us] = [steps, whole]
        .map(|spans| Spread::of(&mut spans.iter().map(|span| span.as_secs_f64() * 1e6).collect::<Vec<_>>()));
    Ok(PhysicsCase {
        name: situation.name(),
        robots,
        median_step_us: step_us.median,
        quartiles_step_us: step_us.quartiles,
        realtime_factor: f64::from(PHYSICS_DT_S) * 1e6 / whole_us.median,
    })
}

/// Builds a world and the commands that keep it in its situation.
fn begin(situation: Situation, robots: usize) -> Result<(World, Vec<RobotCommand>), SimError> {
    let bottles = if situation == Situation::Holding { robots } else { 1 };
    let mut world = World::new(&kitchen(robots, bottles))?;
    let mut commands: Vec<RobotCommand> = (0..robots).map(|robot| world.rest_command(robot)).collect();
    match situation {
        Situation::Standing => {}
        Situation::Walking => commands.iter_mut().for_each(|command| command.base.vx_m_s = WALKING_M_S),
        Situation::Holding => {
            close(&mut commands, NEARLY);
            for _ in 0..CLOSING_CONTROL_STEPS {
                world.control_step(&commands)?;
            }
            for (robot, measured) in world.present().robots.iter().enumerate() {
                let pelvis_from_wrist = measured.sensed.pelvis_from_wrist.right;
                let world_from_wrist = measured.truth.world_from_pelvis() * pelvis_from_wrist;
                let wrist_from_bottle = Pose::from_translation(GRASP_IN_WRIST_M - Vector::Z * HELD_AT_M);
                world.put_object(&bottle_name(robot), world_from_wrist * wrist_from_bottle);
            }
            close(&mut commands, 1.0);
        }
    }
    Ok((world, commands))
}

fn close(commands: &mut [RobotCommand], closed_share: f32) {
    for command in commands {
        let hand = &mut command.upper_rad[HAND_COLUMNS.right..HAND_COLUMNS.right + HAND_JOINTS];
        hand.iter_mut().zip(CLOSED_RAD).for_each(|(target, closed)| *target = closed_share * closed);
    }
}

/// Checks that no robot fell and no object was dropped. Otherwise a different situation was timed.
fn check(world: &World, situation: Situation) {
    let present = world.present();
    for (index, robot) in present.robots.iter().enumerate() {
        assert!(!robot.truth.fallen, "robot {index} fell while {}", situation.name());
        if situation == Situation::Holding {
            let wrist = robot.truth.world_from_pelvis() * robot.sensed.pelvis_from_wrist.right;
            let bottle = present.object(&bottle_name(index)).map(|bottle| bottle.world_from_object);
            let away_m = bottle.map(|bottle| (bottle * (Vector::Z * HELD_AT_M) - wrist.translation).length());
            assert!(
                away_m.is_some_and(|away_m| away_m < 0.2),
                "robot {index} dropped its bottle: {away_m:?}"
            );
        }
    }
}

/// Returns the kitchen with robots at Handover's start positions; a third robot stands away from the
/// furniture. Bottles that are not held yet are out of reach.
fn kitchen(robots: usize, bottles: usize) -> WorldSpec {
    const PLACES: [(f32, f32, f32); MAX_ROBOTS] = [(0.0, 0.0, 0.0), (0.74, -0.12, PI), (-0.9, -1.2, 0.5)];
    let robot = |(index, (x, y, yaw_rad)): (usize, &(f32, f32, f32))| RobotPlacement {
        name: format!("{index}"),
        position_m: [*x, *y],
        yaw_rad: *yaw_rad,
    };
    let bottle = |index: usize| ObjectPlacement {
        name: bottle_name(index),
        file: "bottle".into(),
        world_from_object: Pose::from_translation(Vector::new(0.37, 0.1 + 0.1 * index as f32, 0.8)),
    };
    WorldSpec {
        scene: "kitchen_084".into(),
        robots: PLACES[..robots].iter().enumerate().map(robot).collect(),
        objects: (0..bottles).map(bottle).collect(),
    }
}

fn bottle_name(index: usize) -> String {
    format!("bottle {index}")
}

impl Situation {
    fn name(self) -> &'static str {
        match self {
            Situation::Standing => "standing",
            Situation::Walking => "walking",
            Situation::Holding => "held object",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the position of the bottle in the frame of the wrist that holds it.
    fn held_m(world: &World, robot: usize) -> Vector {
        let present = world.present();
        let bottle = present.object(&bottle_name(robot)).expect("a bottle for every robot").world_from_object;
        let robot = &present.robots[robot];
        let world_from_wrist = robot.truth.world_from_pelvis() * robot.sensed.pelvis_from_wrist.right;
        (world_from_wrist.inverse() * bottle).transform_point(Vector::Z * HELD_AT_M)
    }

    #[test]
    fn held_bottles_do_not_slip() {
        let (mut world, commands) = begin(Situation::Holding, MAX_ROBOTS).unwrap();
        let mut hold_s = |time_s: f32| {
            for _ in 0..(time_s / tandem_sim::CONTROL_DT_S) as usize {
                world.control_step(&commands).unwrap();
            }
            (0..MAX_ROBOTS).map(|robot| held_m(&world, robot)).collect::<Vec<_>>()
        };
        let (before_m, after_m) = (hold_s(2.0), hold_s(5.0));
        for (robot, (before_m, after_m)) in before_m.into_iter().zip(after_m).enumerate() {
            let slipped_m = (after_m - before_m).length();
            assert!(slipped_m < 2e-5, "the bottle of robot {robot} slipped by {slipped_m} m");
        }
    }
}
