//! Description of the room: the sizes of objects, their approximate nominal positions relative to each
//! robot, the furniture near them, and the start poses of partners.

use tandem_sim::mjcf::Geom;
use tandem_sim::{ObjectPart, SimError, Vector, wrapped_rad};

use super::extents::{corners_m, extent_m};
use super::furniture::furniture;
use super::moving::moving;
use super::relative::{places, seen_from};
use crate::tasks::{ObjectSpot, RobotSpot, Spread, Task, told_name};

/// Solids that end within this distance of an object's top belong to the top.
const NECKS_TOP_M: f32 = 0.01;
/// Maximum difference between the two widths of a round object.
const ROUND_M: f32 = 0.005;

/// Returns one line for each object of a task, for example "service trolley, 0.72 m along A's x, 0.44 m along
/// its y, 0.92 m high: middle 0.85 m ahead of A, 3.65 m ahead of B (from the pelvis, give or take 0.32 m)".
/// Lines for parts that move on the objects and for the furniture among the room's fixed geoms follow, and
/// one for each partner.
pub fn room(task: &Task, spread: Spread, fixed: &[Geom]) -> Result<Vec<String>, SimError> {
    let first = &task.robots[0];
    let line = |spot: &ObjectSpot| {
        let parts = spot.parts()?;
        let [x_m, y_m, z_m] = size_m(&parts, spot.yaw_rad - first.yaw_rad).to_array();
        let places = places(task, middle_m(spot, &parts));
        let name = told_name(&spot.name);
        let whole = format!(
            "{name}, {x_m:.2} m along {}'s x, {y_m:.2} m along its y, {z_m:.2} m high{}: middle {places} (from the pelvis{})",
            first.name,
            neck(&parts).unwrap_or_default(),
            give_or_take(task, spot, spread)
        );
        Ok((whole, moving(spot, &parts, first)))
    };
    let things: Vec<(String, Vec<String>)> =
        task.objects.iter().map(line).collect::<Result<_, SimError>>()?;
    let (things, moving): (Vec<String>, Vec<Vec<String>>) = things.into_iter().unzip();
    let others = moving.into_iter().flatten().chain(furniture(task, fixed)).chain(partners(task));
    Ok(things.into_iter().chain(others).collect())
}

/// Returns the other robots' start poses relative to the first, for example "B begins at [1.26, 0.00] m
/// in A's start frame, turned by 3.14 rad".
fn partners(task: &Task) -> Vec<String> {
    let [first, others @ ..] = &task.robots[..] else { return Vec::new() };
    let line = |robot: &RobotSpot| {
        let (ahead_m, left_m) = seen_from(first, robot.position_m);
        let turned_rad = wrapped_rad(robot.yaw_rad - first.yaw_rad);
        let rounded = |part: f32| (part * 100.0).round() / 100.0 + 0.0;
        format!(
            "{} begins at [{:.2}, {:.2}] m in {}'s start frame, turned by {:.2} rad",
            robot.name,
            rounded(ahead_m),
            rounded(left_m),
            first.name,
            rounded(turned_rad)
        )
    };
    others.iter().map(line).collect()
}

/// Returns the largest horizontal displacement of an object by the seed, as a text; empty if it is
/// negligible.
fn give_or_take(task: &Task, spot: &ObjectSpot, spread: Spread) -> String {
    let offsets = task.randomize.iter().filter(|offset| offset.objects.contains(&spot.name));
    let farthest = |[low, high]: [f32; 2]| low.abs().max(high.abs());
    let [x_m, y_m] = offsets.fold([0.0; 2], |[x_m, y_m], offset| {
        let [of_x_m, of_y_m, ..] = offset.ranges(spread);
        [x_m + farthest(of_x_m), y_m + farthest(of_y_m)]
    });
    let most_m = f32::hypot(x_m, y_m);
    if most_m < 0.005 { String::new() } else { format!(", give or take {most_m:.2} m") }
}

/// Returns the middle of an object, which is its origin. For a body of a scene it is the middle of the
/// extent, because the origin may be anywhere.
fn middle_m(spot: &ObjectSpot, parts: &[ObjectPart]) -> [f32; 2] {
    let [x_m, y_m, _] = spot.position_m;
    let [low_m, high_m] = visible_m(parts, spot.yaw_rad);
    let by_m = (low_m + high_m) * 0.5;
    if spot.is_of_scene() && by_m.is_finite() { [x_m + by_m.x, y_m + by_m.y] } else { [x_m, y_m] }
}

/// Returns the size of an object of these parts along the axes of a frame with z up, in which the object has
/// this yaw.
fn size_m(parts: &[ObjectPart], yaw_rad: f32) -> Vector {
    let [low_m, high_m] = visible_m(parts, yaw_rad);
    high_m - low_m
}

/// Returns the lowest and highest coordinates of such an object relative to its origin, along the same axes.
fn visible_m(parts: &[ObjectPart], yaw_rad: f32) -> [Vector; 2] {
    let corners = parts.iter().flat_map(|part| {
        let visible = part.model.geoms.iter().filter(|geom| geom.drawn || geom.collides);
        visible.flat_map(|geom| corners_m(geom, &part.object_from_part))
    });
    extent_m(corners, yaw_rad)
}

/// Returns the width and the neck of a round object in one piece whose top is less than half as wide as the
/// rest, such as a bottle.
fn neck(parts: &[ObjectPart]) -> Option<String> {
    let [part] = parts else { return None };
    let solid = part.model.geoms.iter().filter(|geom| geom.collides);
    let extents: Vec<[Vector; 2]> =
        solid.map(|geom| extent_m(corners_m(geom, &part.object_from_part).into_iter(), 0.0)).collect();
    let top_m = extents.iter().map(|[_, high_m]| high_m.z).fold(f32::MIN, f32::max);
    let (neck, rest): (Vec<_>, Vec<_>) =
        extents.into_iter().partition(|[_, high_m]| top_m - high_m.z < NECKS_TOP_M);
    let joined = |extents: Vec<[Vector; 2]>| extent_m(extents.into_iter().flatten(), 0.0);
    let ([neck_low_m, neck_high_m], [low_m, high_m]) = (joined(neck), joined(rest));
    let (neck_m, rest_m) = (neck_high_m - neck_low_m, high_m - low_m);
    let is_round = |extent_m: Vector| (extent_m.x - extent_m.y).abs() < ROUND_M;
    let is_neck = is_round(rest_m) && is_round(neck_m) && 2.0 * neck_m.x < rest_m.x;
    is_neck.then(|| {
        let (wide_m, narrow_m, to_m) = (rest_m.x, neck_m.x, rest_m.z);
        format!(
            " ({wide_m:.2} m wide up to {to_m:.2} m above its foot, above that a neck of {narrow_m:.2} m)"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks;

    #[test]
    fn things_are_as_large_and_as_far_as_people_would_say() {
        let lines = |id: &str| room(&tasks::find(id).unwrap(), Spread::Single, &[]).unwrap();
        let cart = lines("cart_service");
        assert!(
            cart[0].starts_with("service trolley, ") && cart[0].contains("0.85 m ahead of A"),
            "{cart:?}"
        );
        assert!(cart[0].ends_with("(from the pelvis, give or take 0.32 m)"), "{cart:?}");
        let mark = cart.iter().find(|line| line.starts_with("parking mark, ")).unwrap();
        assert!(mark.ends_with("(from the pelvis)"), "the seed leaves it where it is: {mark}");
        assert!(
            cart.iter().any(|line| line.starts_with("parking mark, ") && line.contains("ahead of B")),
            "{cart:?}"
        );
        let basket = lines("co_carry");
        assert_eq!(basket[2], "B begins at [1.26, 0.00] m in A's start frame, turned by -3.14 rad");
        let handover = lines("handover");
        assert!(
            handover[0].starts_with(
                "bottle, 0.07 m along A's x, 0.07 m along its y, 0.30 m high (0.07 m wide up to 0.20 m above \
                 its foot, above that a neck of 0.03 m): middle"
            ),
            "{handover:?}"
        );
        let with_necks = |id: &&str| lines(id).iter().any(|line| line.contains(" neck of "));
        let ids: Vec<String> = tasks::cohub().iter().map(|task| task.id.clone()).collect();
        let found: Vec<&str> = ids.iter().map(String::as_str).filter(with_necks).collect();
        assert_eq!(found, ["handover", "cart_service"], "of CoHub's things only bottles have one");
        for task in tasks::cohub() {
            let lines = lines(&task.id);
            let moving = if task.id == "move_house" { 2 } else { 0 };
            assert_eq!(lines.len(), task.objects.len() + moving + task.robots.len() - 1);
            for (index, line) in lines.iter().enumerate() {
                println!("{}: {line}", task.id);
                assert!(!line.contains("inf") && !line.contains("NaN"), "{line}");
                assert!(
                    index >= task.objects.len() || !line.contains('-'),
                    "things are ahead or behind: {line}"
                );
            }
        }
    }
}
