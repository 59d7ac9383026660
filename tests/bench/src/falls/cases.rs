//! The table of cases, and the worlds of those that do not belong to a task.

use std::f32::consts::{PI, TAU};

use tandem_sim::body::{ARM_COLUMNS, ARM_JOINTS};
use tandem_sim::{
    CONTROL_DT_S, ObjectPlacement, Pose, RobotCommand, RobotPlacement, Rotation, SimError, SplitMix64,
    Vector, World, WorldSpec,
};

use super::commands::{Stagger, Staggering};
use super::{FallTrial, floor, play};

/// One situation; a seed draws its commands and the initial poses.
pub struct FallCase {
    pub name: &'static str,
    pub place: FallPlace,
    stagger: Stagger,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FallPlace {
    /// The world of a task, over the whole step budget of its episodes.
    Task,
    /// The world of a task, with the first robot dropped on an object and the object's support.
    TaskFromAbove,
    /// A single robot on an empty floor, without balance control.
    Floor,
    /// A robot dropped on another.
    OnRobot,
    /// A table dropped on a robot.
    TableOnRobot,
    /// A door that closes on a robot's hand.
    Door,
}

const fn staggering(name: &'static str, amplitude_share: f32, hold_steps: u32) -> FallCase {
    case(name, FallPlace::Task, Stagger { amplitude_share, hold_steps, pace_rad_s: 3.0 })
}

const fn case(name: &'static str, place: FallPlace, stagger: Stagger) -> FallCase {
    FallCase { name, place, stagger }
}

const HALF: Stagger = Stagger { amplitude_share: 0.5, hold_steps: 10, pace_rad_s: 3.0 };
const SLIGHT: Stagger = Stagger { amplitude_share: 0.1, hold_steps: 10, pace_rad_s: 1.5 };
/// Targets that jump, like the targets that a caller may send.
const JUMPING: Stagger = Stagger { amplitude_share: 1.0, hold_steps: 10, pace_rad_s: f32::INFINITY };

pub const FALL_CASES: [FallCase; 15] = [
    staggering("stagger_0.2_20ms", 0.2, 1),
    staggering("stagger_0.2_200ms", 0.2, 10),
    staggering("stagger_0.2_500ms", 0.2, 25),
    staggering("stagger_0.5_20ms", 0.5, 1),
    staggering("stagger_0.5_200ms", 0.5, 10),
    staggering("stagger_0.5_500ms", 0.5, 25),
    staggering("stagger_1.0_20ms", 1.0, 1),
    staggering("stagger_1.0_200ms", 1.0, 10),
    staggering("stagger_1.0_500ms", 1.0, 25),
    case("stagger_jumps", FallPlace::Task, JUMPING),
    case("alone_on_floor", FallPlace::Floor, JUMPING),
    case("drop_on_furniture", FallPlace::TaskFromAbove, HALF),
    case("drop_on_robot", FallPlace::OnRobot, HALF),
    case("table_on_robot", FallPlace::TableOnRobot, HALF),
    case("door_on_hand", FallPlace::Door, SLIGHT),
];

/// Number of control steps of cases without a task's step budget. Falling bodies are at rest by then.
const SHORT_STEPS: u32 = 300;
const DROP_M: f32 = 1.0;
/// Height of a robot's head.
const HEAD_M: f32 = 1.3;
/// Extent of a lying robot below its pelvis.
const LYING_M: f32 = 0.15;
const AIM_M: f32 = 0.2;
/// Maximum number of draws of a start pose, and the extra height per draw. Some objects hang on walls next
/// to robots: a pose that overlaps with them is drawn again, a little higher.
const DRAWS: usize = 1000;
const HIGHER_M: f32 = 0.05;

/// Position of a robot in front of the doorway. Its right arm reaches through it, close to the latch post.
const AT_DOOR_M: [f32; 2] = [-0.28, -0.25];
const REACHING_RAD: [f32; ARM_JOINTS] = [-0.35, -0.2, 0.0, 0.3, 0.0, 0.0, 0.0];
const HINGE: &str = "hinge";
const OPEN_RAD: f64 = 1.2;
/// Time at which the door is slammed, its initial speed, and the force at the point `EDGE_M` on its edge at
/// the height of the hand. A person in a hurry pushes a door like this.
const SHUTS_AFTER_S: f32 = 1.5;
const SLAM_RAD_S: f64 = 3.0;
const SHUTTING_N: f32 = 40.0;
const EDGE_M: Vector = Vector::new(-0.025, -0.9, 1.0);

impl FallCase {
    /// Builds the world of a case that does not belong to a task.
    ///
    /// # Errors
    ///
    /// Returns an error if an embedded file cannot be used.
    pub fn world(&self) -> Result<World, SimError> {
        let robot =
            |name: &str, position_m: [f32; 2]| RobotPlacement { name: name.into(), position_m, yaw_rad: 0.0 };
        let object = |file: &str| ObjectPlacement {
            name: file.into(),
            file: file.into(),
            world_from_object: Pose::IDENTITY,
        };
        let (robots, objects) = match self.place {
            FallPlace::Task | FallPlace::TaskFromAbove | FallPlace::Floor => {
                (vec![robot("A", [0.0; 2])], vec![])
            }
            FallPlace::OnRobot => (vec![robot("A", [0.0; 2]), robot("B", [3.0, 0.0])], vec![]),
            FallPlace::TableOnRobot => (vec![robot("A", [0.0; 2])], vec![object("office_table")]),
            FallPlace::Door => (vec![robot("A", AT_DOOR_M)], vec![object("lever_door")]),
        };
        World::new(&WorldSpec { scene: "floor".into(), robots, objects })
    }

    /// Plays one seed in `world`, which is a task's world or [`FallCase::world`]. `budget_steps` is the
    /// number of control steps of a task's episode.
    pub fn play(&self, world: &mut World, budget_steps: u32, seed: u64) -> FallTrial {
        let mut random = SplitMix64(seed ^ 0x5eed);
        match self.place {
            FallPlace::Task => self.stagger(world, budget_steps, seed),
            FallPlace::Floor => floor::thrash(world, self.stagger, SHORT_STEPS, seed),
            FallPlace::TaskFromAbove => {
                drop_on_an_object(world, &mut random);
                self.stagger(world, SHORT_STEPS, seed)
            }
            FallPlace::OnRobot => {
                world.put_robot(1, lying(Vector::Z * (HEAD_M + DROP_M + LYING_M), &mut random));
                self.stagger(world, SHORT_STEPS, seed)
            }
            FallPlace::TableOnRobot => {
                world.put_object("office_table", lying(Vector::Z * (HEAD_M + DROP_M + 0.4), &mut random));
                self.stagger(world, SHORT_STEPS, seed)
            }
            FallPlace::Door => self.shut_door(world, seed),
        }
    }

    fn stagger(&self, world: &mut World, steps: u32, seed: u64) -> FallTrial {
        let mut robots: Vec<Staggering> =
            (0..world.robots().len()).map(|robot| Staggering::of(world, robot, self.stagger, seed)).collect();
        play(world, steps, |_, step| robots.iter_mut().map(|robot| robot.next(step)).collect())
    }

    fn shut_door(&self, world: &mut World, seed: u64) -> FallTrial {
        let mut robot = Staggering::of(world, 0, self.stagger, seed);
        let rest = world.rest_command(0);
        let mut reaching_rad = rest.upper_rad;
        reaching_rad[ARM_COLUMNS.right..ARM_COLUMNS.right + ARM_JOINTS].copy_from_slice(&REACHING_RAD);
        robot.about(reaching_rad);
        world.set_object_hinge(HINGE, OPEN_RAD, 0.0);
        play(world, SHORT_STEPS, |world, step| {
            let time_s = step as f32 * CONTROL_DT_S;
            let angle_rad = world.joint_position(HINGE).unwrap_or_default();
            if step == (SHUTS_AFTER_S / CONTROL_DT_S) as u32 {
                world.set_object_hinge(HINGE, angle_rad, -SLAM_RAD_S);
            }
            if time_s >= SHUTS_AFTER_S {
                let (sine, cosine) = (angle_rad as f32).sin_cos();
                world.push_object(HINGE, EDGE_M, Vector::new(-cosine, -sine, 0.0) * SHUTTING_N);
            }
            // The robot stands at the door until the door strikes it, with random arm motion.
            vec![RobotCommand { base: rest.base, ..robot.next(step) }]
        })
    }
}

/// Places the first robot above a random object and its support, in a pose without overlap.
fn drop_on_an_object(world: &mut World, random: &mut SplitMix64) {
    let objects = world.present().objects;
    for draw in 0..DRAWS {
        let drawn = random.uniform([0.0, objects.len() as f32]) as usize;
        let object_m = objects[drawn.min(objects.len() - 1)].state.world_from_object.translation;
        let above_m = DROP_M + LYING_M + HIGHER_M * draw as f32;
        world.put_robot(0, lying(object_m + Vector::Z * above_m, random));
        if !world.overlaps(0) {
            return;
        }
    }
    panic!("the robot overlaps with something wherever it is put, up to {} m", HIGHER_M * DRAWS as f32);
}

/// Returns the pose of a robot lying on its front, back or side, near `at_m`.
fn lying(at_m: Vector, random: &mut SplitMix64) -> Pose {
    let mut by_m = || random.uniform([-AIM_M, AIM_M]);
    let at_m = at_m + Vector::new(by_m(), by_m(), 0.0);
    let heading = Rotation::from_rotation_z(random.uniform([0.0, TAU]));
    let rolled = Rotation::from_rotation_x(random.uniform([0.0, TAU]));
    Pose::from_parts(at_m, heading * rolled * Rotation::from_rotation_y(PI / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The door strikes the arm in the doorway, and pushes back the robot, which would otherwise stand still.
    #[test]
    fn the_door_strikes_the_robot_before_it() {
        let case = FALL_CASES.iter().find(|case| case.name == "door_on_hand").expect("a case");
        for seed in 2000..2004 {
            let mut world = case.world().expect("a world");
            case.play(&mut world, 0, seed);
            let pelvis_m = world.present().robots[0].truth.world_from_pelvis().translation;
            let driven_m = (pelvis_m.x - AT_DOOR_M[0]).hypot(pelvis_m.y - AT_DOOR_M[1]);
            assert!(driven_m > 0.15, "seed {seed}: the robot stands {driven_m} m from its place");
        }
    }

    /// Dropped tables must hit a robot. Otherwise the case would have no effect.
    #[test]
    fn tables_meet_robots() {
        let case = FALL_CASES.iter().find(|case| case.name == "table_on_robot").expect("a case");
        let fell = |seed| case.play(&mut case.world().expect("a world"), 0, seed).fallen;
        assert!((2000..2020).map(fell).sum::<usize>() >= 1, "no robot fell under a table");
    }
}
