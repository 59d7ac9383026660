//! Description of the furniture: fixed geoms near the robots and the task's objects.

use tandem_sim::mjcf::Geom;
use tandem_sim::{Pose, Rotation, Vector};

use super::extents::{corners_m, extent_m};
use super::relative::places;
use crate::tasks::Task;

/// Maximum horizontal distance of furniture from a robot's start position or from an object of the task.
const MAX_DISTANCE_M: f32 = 1.0;
/// Minimum height of the top, and maximum height of the underside, of a piece that obstructs hands or feet.
const MIN_TOP_M: f32 = 0.1;
const MAX_BOTTOM_M: f32 = 1.6;
/// Maximum gap between a support and the piece that hides it.
const MAX_GAP_M: f32 = 0.05;

/// Bounds of a fixed geom, in world coordinates that are turned about the origin to the heading at which the
/// first robot starts.
struct Piece<'a> {
    name: &'a str,
    low_m: Vector,
    high_m: Vector,
}

/// Returns one line for each fixed geom near the robots or the task's objects, for example "counter, fixed,
/// 0.40 m along A's x, 0.84 m along its y, from 0.76 to 0.80 m above the floor: middle 0.37 m ahead of A and
/// 0.12 m to the right of A". A geom without a name, and one that only supports another, has none.
pub fn furniture(task: &Task, fixed: &[Geom]) -> Vec<String> {
    let Some(first) = task.robots.first() else { return Vec::new() };
    let turn = Rotation::from_rotation_z(-first.yaw_rad);
    let pieces: Vec<Piece> = fixed.iter().filter_map(|geom| Piece::of(geom, first.yaw_rad)).collect();
    let of_robots = task.robots.iter().map(|robot| robot.position_m);
    let of_objects = task.objects.iter().map(|spot| [spot.position_m[0], spot.position_m[1]]);
    let near_m: Vec<Vector> =
        of_robots.chain(of_objects).map(|[x_m, y_m]| turn * Vector::new(x_m, y_m, 0.0)).collect();
    let listed = pieces.iter().filter(|piece| {
        piece.high_m.z > MIN_TOP_M
            && piece.low_m.z < MAX_BOTTOM_M
            && near_m.iter().any(|at_m| piece.distance_m(*at_m) < MAX_DISTANCE_M)
            && !pieces.iter().any(|other| other.hides(piece))
    });
    listed.map(|piece| piece.line(task, first.name, turn.inverse())).collect()
}

impl Piece<'_> {
    /// Returns the extent of a geom that has a name and collides, for a first robot with this yaw.
    fn of(geom: &Geom, yaw_rad: f32) -> Option<Piece<'_>> {
        let name = geom.name.as_deref().filter(|_| geom.collides)?;
        let [low_m, high_m] = extent_m(corners_m(geom, &Pose::IDENTITY).into_iter(), -yaw_rad);
        Some(Piece { name, low_m, high_m })
    }

    fn line(&self, task: &Task, first: &str, world_from_turned: Rotation) -> String {
        let size_m = self.high_m - self.low_m;
        let middle_m = world_from_turned * (0.5 * (self.low_m + self.high_m));
        let name = self.name.replace('_', " ");
        // The part of a foot that reaches into the floor does not count.
        let bottom_m = self.low_m.z.max(0.0);
        format!(
            "{name}, fixed, {:.2} m along {first}'s x, {:.2} m along its y, from {bottom_m:.2} to {:.2} m above the floor: middle {}",
            size_m.x,
            size_m.y,
            self.high_m.z,
            places(task, [middle_m.x, middle_m.y])
        )
    }

    /// Returns the horizontal distance of a point from this piece; 0 above, below or within it.
    fn distance_m(&self, at_m: Vector) -> f32 {
        let beside_m = (self.low_m - at_m).max(at_m - self.high_m).max(Vector::ZERO);
        beside_m.x.hypot(beside_m.y)
    }

    /// Returns true if `other` ends below this piece and does not stick out: a foot under a top.
    fn hides(&self, other: &Piece) -> bool {
        let is_below = other.high_m.z < self.high_m.z && other.high_m.z > self.low_m.z - MAX_GAP_M;
        is_below
            && other.low_m.x >= self.low_m.x
            && other.low_m.y >= self.low_m.y
            && other.high_m.x <= self.high_m.x
            && other.high_m.y <= self.high_m.y
    }
}

#[cfg(test)]
mod tests {
    use tandem_sim::mjcf::Document;

    use super::*;
    use crate::tasks;

    fn lines(geoms: &str) -> Vec<String> {
        let mjcf = format!("<mujoco><worldbody>{geoms}</worldbody></mujoco>");
        let room = Document::parse_alone("room.xml", &mjcf).unwrap().trees().unwrap();
        let fixed: Vec<Geom> = room.iter().flat_map(|tree| tree.links[0].geoms.clone()).collect();
        furniture(&tasks::find("handover").unwrap(), &fixed)
    }

    #[test]
    fn a_counter_is_told_by_its_size_its_top_and_its_place() {
        let counter = r#"<geom name="counter_top" type="box" pos="0.37 -0.12 0.78" size="0.2 0.42 0.02"/>"#;
        assert_eq!(
            lines(counter),
            [
                "counter top, fixed, 0.40 m along A's x, 0.84 m along its y, from 0.76 to 0.80 m above the floor: middle 0.37 m \
                 ahead of A and 0.12 m to the right of A, 0.37 m ahead of B"
            ]
        );
    }

    #[test]
    fn feet_under_tops_floors_and_what_is_far_or_only_seen_are_left_out() {
        let top = r#"<geom name="top" type="box" pos="0.37 0 0.78" size="0.2 0.42 0.02"/>"#;
        assert_eq!(lines(top).len(), 1);
        let others = r#"
            <geom name="floor" type="plane" size="3 3 0.1"/>
            <geom name="foot" type="box" pos="0.37 0 0.38" size="0.04 0.3 0.38"/>
            <geom name="far" type="box" pos="0.37 3 0.5" size="0.3 0.3 0.5"/>
            <geom name="lamp" type="box" pos="0.37 0 2.4" size="0.3 0.3 0.1"/>
            <geom name="picture" type="box" pos="0.37 0.8 1" size="0.3 0.02 0.3" contype="0" conaffinity="0"/>
            <geom type="box" pos="0.37 0.8 0.5" size="0.3 0.02 0.5"/>"#;
        assert_eq!(lines(&format!("{others}{top}")), lines(top));
        let beside = r#"<geom name="wide_foot" type="box" pos="0.37 0 0.38" size="0.3 0.3 0.38"/>"#;
        assert_eq!(lines(&format!("{top}{beside}")).len(), 2, "knees run into what sticks out");
    }
}
