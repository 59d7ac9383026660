//! Places relative to robots at their start.

use crate::tasks::{RobotSpot, Task};

/// Describes a point relative to each robot at the start.
pub fn places(task: &Task, at_m: [f32; 2]) -> String {
    let places: Vec<String> = task.robots.iter().map(|robot| place(robot, at_m)).collect();
    places.join(", ")
}

fn place(robot: &RobotSpot, at_m: [f32; 2]) -> String {
    let (ahead_m, left_m) = seen_from(robot, at_m);
    let part = |part_m: f32, towards: &str, away: &str| {
        let words = if part_m < 0.0 { away } else { towards };
        (part_m.abs() >= 0.005).then(|| format!("{:.2} m {words} {}", part_m.abs(), robot.name))
    };
    let parts = [part(ahead_m, "ahead of", "behind"), part(left_m, "to the left of", "to the right of")];
    let told: Vec<String> = parts.into_iter().flatten().collect();
    if told.is_empty() { format!("where {} stands", robot.name) } else { told.join(" and ") }
}

/// Returns the position of a point relative to a robot at the start: ahead of it, and to its left.
pub fn seen_from(robot: &RobotSpot, [x_m, y_m]: [f32; 2]) -> (f32, f32) {
    let (east_m, north_m) = (x_m - robot.position_m[0], y_m - robot.position_m[1]);
    let (sine, cosine) = robot.yaw_rad.sin_cos();
    (cosine * east_m + sine * north_m, cosine * north_m - sine * east_m)
}
