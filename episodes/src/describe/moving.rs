//! Description of the parts that move on an object: doors, levers, drawers.

use tandem_sim::mjcf::Geom;
use tandem_sim::{ObjectPart, Pose, Rotation, Vector};

use super::extents::{corners_m, extent_m};
use super::relative::seen_from;
use crate::tasks::{ObjectSpot, RobotSpot, told_name};

/// Minimum travel of a part's far end.
const MIN_TRAVEL_M: f32 = 0.05;
/// Maximum difference from the largest travel at which points count as the far end.
const SAME_TRAVEL_M: f32 = 0.01;

/// Returns one line for each part that moves on an object within a range, for example "lever door leaf, 0.11 m
/// along A's x, 0.94 m along its y, from 0.01 to 1.99 m above the floor: turns by up to 1.60 rad, its far end
/// from [0.55, 0.13, 1.00] to [1.52, 1.08, 1.00] m in A's start frame, z above the floor".
pub fn moving(spot: &ObjectSpot, parts: &[ObjectPart], first: &RobotSpot) -> Vec<String> {
    let turned = Rotation::from_rotation_z(spot.yaw_rad);
    let world_from_object = Pose::from_parts(spot.position_m.into(), turned);
    parts.iter().filter_map(|part| line(part, &world_from_object, first)).collect()
}

fn line(part: &ObjectPart, world_from_object: &Pose, first: &RobotSpot) -> Option<String> {
    let world_from_part = *world_from_object * part.object_from_part;
    let part_from_moved = world_from_part.inverse() * (*world_from_object * part.object_from_moved_part?);
    let drawn = part.model.geoms.iter().filter(|geom| geom.drawn || geom.collides);
    let points_m: Vec<Vector> = drawn.flat_map(|geom: &Geom| corners_m(geom, &Pose::IDENTITY)).collect();
    let travel_m = |point_m: &Vector| (part_from_moved * *point_m - *point_m).length();
    let most_m = points_m.iter().map(travel_m).fold(0.0, f32::max);
    if most_m < MIN_TRAVEL_M {
        return None;
    }
    let far: Vec<&Vector> =
        points_m.iter().filter(|point_m| travel_m(point_m) > most_m - SAME_TRAVEL_M).collect();
    let far_m = far.iter().copied().sum::<Vector>() / far.len() as f32;
    let [low_m, high_m] = extent_m(points_m.iter().map(|point_m| world_from_part * *point_m), -first.yaw_rad);
    let size_m = high_m - low_m;
    let angle_rad = Vector::X.angle_between(part_from_moved.rotation * Vector::X);
    let angle_rad = angle_rad.max(Vector::Y.angle_between(part_from_moved.rotation * Vector::Y));
    let way = if angle_rad > 0.0 { format!("turns by up to {angle_rad:.2} rad") } else { "slides".into() };
    let told = |point_m: Vector| {
        let (ahead_m, left_m) = seen_from(first, [point_m.x, point_m.y]);
        let [ahead_m, left_m, up_m] =
            [ahead_m, left_m, point_m.z].map(|part| (part * 100.0).round() / 100.0 + 0.0);
        format!("[{ahead_m:.2}, {left_m:.2}, {up_m:.2}]")
    };
    Some(format!(
        "{}, {:.2} m along {name}'s x, {:.2} m along its y, from {:.2} to {:.2} m above the floor: {way}, its far end from {} to {} m \
         in {name}'s start frame, z above the floor",
        told_name(&part.name),
        size_m.x,
        size_m.y,
        low_m.z,
        high_m.z,
        told(world_from_part * far_m),
        told(world_from_part * (part_from_moved * far_m)),
        name = first.name,
    ))
}

#[cfg(test)]
mod tests {
    use tandem_sim::ObjectModel;

    use super::*;
    use crate::tasks;

    /// A begins 0.55 m before the door and 0.60 m beside its middle, and faces it.
    #[test]
    fn a_door_and_its_lever_are_told_by_where_their_far_ends_go() {
        let task = tasks::find("move_house").unwrap();
        let door = task.objects.iter().find(|spot| spot.name == "lever_door").unwrap();
        let parts = ObjectModel::parts(&door.source, &door.name).unwrap();
        assert_eq!(
            moving(door, &parts, &task.robots[0]),
            [
                "lever door leaf, 0.11 m along A's x, 0.94 m along its y, from 0.01 to 1.99 m above the floor: turns by up to 1.60 rad, \
                 its far end from [0.55, 0.13, 1.00] to [1.52, 1.08, 1.00] m in A's start frame, z above the floor",
                "lever door lever, 0.06 m along A's x, 0.15 m along its y, from 0.94 to 0.96 m above the floor: turns by up to 0.80 rad, \
                 its far end from [0.48, 0.33, 0.95] to [0.48, 0.29, 0.85] m in A's start frame, z above the floor",
            ]
        );
        for other in &task.objects {
            let parts = ObjectModel::parts(&other.source, &other.name).unwrap();
            assert_eq!(moving(other, &parts, &task.robots[0]).is_empty(), other.name != "lever_door");
        }
    }
}
