//! Layout stress: the seed moves objects farther, like `--spread`, and the world has distractors: vessels
//! on the tables, boxes on the floor. Distractors are objects like all others, and are placed beside the
//! ways of hands and loads.

use std::f32::consts::TAU;
use std::sync::OnceLock;

use serde::Deserialize;
use tandem_sim::mjcf::{Geom, Primitive};
use tandem_sim::{ObjectModel, ObjectPlacement, Pose, Rotation, SimError, SplitMix64, Vector, World};

use super::{StressAxis, StressLevel, random};
use crate::tasks::{Spread, Task};

pub fn spread(level: StressLevel) -> Spread {
    level.of([Spread::Double, Spread::Triple, Spread::Quadruple])
}

/// Returns the number of distractors.
pub fn count(level: StressLevel) -> usize {
    level.of([1, 2, 3])
}

/// Files of possible distractors: objects that no task uses as a goal, and that stand by themselves.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Distractors {
    on_tables: Vec<String>,
    on_floors: Vec<String>,
}

fn files() -> &'static Distractors {
    static READ: OnceLock<Distractors> = OnceLock::new();
    READ.get_or_init(|| {
        serde_json::from_str(include_str!("distractors.json")).expect("the sessions' tests read the file")
    })
}

/// Maximum distance between an object's lowest point and the top of its support.
const CONTACT_M: f32 = 0.015;
/// Free space beside a distractor; `ABOVE_M` is the free space above its support.
const BESIDE_M: f32 = 0.03;
const ABOVE_M: f32 = 0.01;
/// Number of placement attempts for each distractor.
const DRAWS: usize = 400;

/// Minimum distances of a distractor on one kind of support from relevant things.
struct Clearance {
    /// Distance from middle to middle, minus both radii.
    object_m: f32,
    /// Distance from the lines between objects, along which they are carried.
    way_m: f32,
    robot_m: f32,
    /// Distance from the lines from robots to objects.
    reach_m: f32,
    /// Maximum distance from the task's middle.
    farthest_m: f32,
}

const TABLE: Clearance =
    Clearance { object_m: 0.12, way_m: 0.14, robot_m: 0.30, reach_m: 0.14, farthest_m: 1.0 };
const FLOOR: Clearance =
    Clearance { object_m: 0.40, way_m: 0.8, robot_m: 0.9, reach_m: 0.6, farthest_m: 2.2 };

/// A support for distractors: a level rectangle.
struct Support {
    top_m: f32,
    middle_m: [f32; 2],
    half_m: [f32; 2],
    yaw_rad: f32,
    is_floor: bool,
}

/// Returns the distractors of an episode of `task` in `world`, which already has all other objects. There are
/// at most `most`, and fewer if there is no space.
pub fn distractors(
    most: usize,
    seed: u32,
    task: &Task,
    world: &World,
) -> Result<Vec<ObjectPlacement>, SimError> {
    let places = Places::of(task, world)?;
    let tables = tables(world, &places);
    let half_m = [FLOOR.farthest_m; 2];
    let floor = [Support { top_m: 0.0, middle_m: places.middle_m, half_m, yaw_rad: 0.0, is_floor: true }];
    let mut placed: Vec<(ObjectPlacement, [f32; 2], f32)> = Vec::new();
    for number in 0..most {
        let mut random = random(StressAxis::Layout, seed, number);
        // The floor serves if no table has room.
        let kinds_of_support = [&tables[..], &floor].into_iter().filter(|supports| !supports.is_empty());
        let found = kinds_of_support.flat_map(|supports| [supports; DRAWS]).find_map(|supports| {
            let support = &supports[pick(&mut random, supports.len())];
            let file = kind(support, task, &mut random)?;
            let at_m = support.point(&mut random);
            let turn_rad = random.uniform([0.0, TAU]);
            // Most draws fail here, and files are only read for the others.
            if places.are_near(at_m, 0.0, support.clearance()) {
                return None;
            }
            let (model, half_m) = measured(file)?;
            let radius_m = half_m.x.hypot(half_m.y);
            let beside = |(_, other_m, other_radius_m): &(ObjectPlacement, [f32; 2], f32)| {
                distance_m(*other_m, at_m) < other_radius_m + radius_m + BESIDE_M
            };
            let taken = placed.iter().any(beside) || places.are_near(at_m, radius_m, support.clearance());
            let base_m = Vector::new(at_m[0], at_m[1], support.top_m);
            let room_m = Vector::new(radius_m + BESIDE_M, radius_m + BESIDE_M, half_m.z);
            let inside = support.holds(at_m, radius_m);
            if taken || !inside || world.touches_box(base_m + Vector::Z * (half_m.z + ABOVE_M), room_m) {
                return None;
            }
            let turn = Rotation::from_rotation_z(turn_rad);
            let world_from_object =
                Pose::from_parts(base_m - Vector::Z * model.lowest_m(&Pose::IDENTITY), turn);
            let name = format!("distractor_{}", number + 1);
            Some((ObjectPlacement { name, file: file.into(), world_from_object }, at_m, radius_m))
        });
        placed.extend(found);
    }
    Ok(placed.into_iter().map(|(placement, ..)| placement).collect())
}

/// Positions of the task's objects and robots, seen from above.
struct Places {
    objects_m: Vec<([f32; 2], f32)>,
    /// Lowest points of the objects.
    bases_m: Vec<f32>,
    robots_m: Vec<[f32; 2]>,
    middle_m: [f32; 2],
}

impl Places {
    fn of(task: &Task, world: &World) -> Result<Places, SimError> {
        let step = world.present();
        let (mut objects_m, mut bases_m) = (Vec::new(), Vec::new());
        for spot in &task.objects {
            let Some(state) = step.object(&spot.name) else { continue };
            let pose = state.world_from_object;
            for part in ObjectModel::parts(&spot.source, &spot.name)?.into_iter().take(1) {
                let at_m = [pose.translation.x, pose.translation.y];
                let reach_m = |direction: Vector| {
                    part.model.reach_m(&pose, direction) - direction.dot(pose.translation)
                };
                let reaches_m = [Vector::X, Vector::Y, Vector::NEG_X, Vector::NEG_Y].map(reach_m);
                let radius_m = reaches_m.into_iter().fold(0.0_f32, f32::max);
                objects_m.push((at_m, if radius_m.is_finite() { radius_m } else { 0.0 }));
                let lowest_m = part.model.lowest_m(&pose);
                bases_m.push(if lowest_m.is_finite() { lowest_m } else { pose.translation.z });
            }
        }
        let robots_m = step.robots.iter().map(|robot| {
            let Vector { x, y, .. } = robot.truth.world_from_pelvis().translation;
            [x, y]
        });
        let robots_m: Vec<[f32; 2]> = robots_m.collect();
        let all = || robots_m.iter().chain(objects_m.iter().map(|(at_m, _)| at_m));
        let mean = |axis: usize| all().map(|at_m| at_m[axis]).sum::<f32>() / all().count() as f32;
        Ok(Places { middle_m: [mean(0), mean(1)], objects_m, bases_m, robots_m })
    }

    /// Returns `true` if an object of this radius would be too near to a relevant object, or too far from the
    /// task's middle.
    fn are_near(&self, at_m: [f32; 2], radius_m: f32, clearance: &Clearance) -> bool {
        let Clearance { object_m, way_m, robot_m, reach_m, farthest_m } = clearance;
        let objects = || self.objects_m.iter().map(|(at_m, _)| *at_m);
        let near_object = self.objects_m.iter().any(|(other_m, other_radius_m)| {
            distance_m(*other_m, at_m) < other_radius_m.min(0.5) + radius_m + object_m
        });
        let on_way =
            objects().any(|from_m| objects().any(|to_m| from_line_m(at_m, from_m, to_m) < radius_m + way_m));
        let near_robot = self.robots_m.iter().any(|robot_at_m| {
            let reached = objects().any(|to_m| {
                distance_m(*robot_at_m, to_m) < 2.0
                    && from_line_m(at_m, *robot_at_m, to_m) < radius_m + reach_m
            });
            reached || distance_m(*robot_at_m, at_m) < radius_m + robot_m
        });
        near_object || on_way || near_robot || distance_m(self.middle_m, at_m) > *farthest_m
    }
}

/// Returns the supports of the task's objects above the floor.
fn tables(world: &World, places: &Places) -> Vec<Support> {
    let tables = world.room().iter().filter_map(table).filter(|table| {
        let under = |base_m: &f32| (base_m - table.top_m).abs() < CONTACT_M;
        table.top_m > 0.3 && places.bases_m.iter().any(under)
    });
    tables.collect()
}

/// Returns the top of a box, if it is level.
fn table(geom: &Geom) -> Option<Support> {
    let Primitive::Box { half_extents_m } = geom.primitive else { return None };
    let Pose { translation, rotation, .. } = geom.body_from_geom;
    let upright = (rotation * Vector::Z).z > 0.999;
    (upright && geom.collides).then(|| {
        let ahead = rotation * Vector::X;
        Support {
            top_m: translation.z + half_extents_m.z,
            middle_m: [translation.x, translation.y],
            half_m: [half_extents_m.x, half_extents_m.y],
            yaw_rad: ahead.y.atan2(ahead.x),
            is_floor: false,
        }
    })
}

impl Support {
    fn clearance(&self) -> &'static Clearance {
        if self.is_floor { &FLOOR } else { &TABLE }
    }

    fn point(&self, random: &mut SplitMix64) -> [f32; 2] {
        let [x_m, y_m] = self.half_m.map(|half_m| random.uniform([-half_m, half_m]));
        let (sine, cosine) = self.yaw_rad.sin_cos();
        [self.middle_m[0] + cosine * x_m - sine * y_m, self.middle_m[1] + sine * x_m + cosine * y_m]
    }

    /// Returns `true` if an object of this radius fits on the support without overhang.
    fn holds(&self, at_m: [f32; 2], radius_m: f32) -> bool {
        let [x_m, y_m] = [at_m[0] - self.middle_m[0], at_m[1] - self.middle_m[1]];
        let (sine, cosine) = self.yaw_rad.sin_cos();
        let own_m = [cosine * x_m + sine * y_m, cosine * y_m - sine * x_m];
        own_m.into_iter().zip(self.half_m).all(|(own_m, half_m)| own_m.abs() + radius_m < half_m)
    }
}

/// Draws a file for a distractor on this support. The task's own objects are excluded, so that its
/// instructions stay unambiguous.
fn kind(support: &Support, task: &Task, random: &mut SplitMix64) -> Option<&'static str> {
    let kinds = if support.is_floor { &files().on_floors } else { &files().on_tables };
    let own = |file: &str| task.objects.iter().any(|spot| spot.file == file);
    let free: Vec<&'static str> = kinds.iter().map(String::as_str).filter(|file| !own(file)).collect();
    (!free.is_empty()).then(|| free[pick(random, free.len())])
}

fn pick(random: &mut SplitMix64, count: usize) -> usize {
    (random.uniform([0.0, count as f32]) as usize).min(count - 1)
}

/// Returns an object's model, and half of its extent along each axis about its middle.
fn measured(file: &str) -> Option<(ObjectModel, Vector)> {
    let model = ObjectModel::parts(&file.into(), file).ok()?.swap_remove(0).model;
    let reach_m = |direction: Vector| model.reach_m(&Pose::IDENTITY, direction);
    let half_m = Vector::new(
        reach_m(Vector::X).max(reach_m(Vector::NEG_X)),
        reach_m(Vector::Y).max(reach_m(Vector::NEG_Y)),
        0.5 * (reach_m(Vector::Z) + reach_m(Vector::NEG_Z)),
    );
    Some((model, half_m))
}

fn distance_m(a_m: [f32; 2], b_m: [f32; 2]) -> f32 {
    (a_m[0] - b_m[0]).hypot(a_m[1] - b_m[1])
}

/// Returns the distance of a point from the line segment between two others.
fn from_line_m(at_m: [f32; 2], from_m: [f32; 2], to_m: [f32; 2]) -> f32 {
    let [dx_m, dy_m] = [to_m[0] - from_m[0], to_m[1] - from_m[1]];
    let square = dx_m * dx_m + dy_m * dy_m;
    let along = (at_m[0] - from_m[0]) * dx_m + (at_m[1] - from_m[1]) * dy_m;
    let share = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
    distance_m(at_m, [from_m[0] + share * dx_m, from_m[1] + share * dy_m])
}
