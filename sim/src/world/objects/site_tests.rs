//! Tests of objects against their documentation: sites are on shapes or in the open, and objects that robots
//! carry have the documented size and mass.

use rapier3d::math::Vector;
use rapier3d::parry::bounding_volume::BoundingVolume as _;

use super::ObjectModel;
use crate::assets;
use crate::mjcf::Site;

/// Returns the distance from a point of an object to its nearest shape; 0 inside one.
fn clearance_m(model: &ObjectModel, point_m: Vector) -> f32 {
    let shapes = model.geoms.iter().filter(|geom| geom.collides).filter_map(|geom| geom.collider());
    shapes.map(|(pose, shape)| shape.distance_to_point(&pose, point_m, true)).fold(f32::INFINITY, f32::min)
}

fn object(name: &str) -> ObjectModel {
    let mut parts = ObjectModel::parts(&name.into(), name).unwrap_or_else(|error| panic!("{error}"));
    parts.remove(0).model
}

fn site<'a>(model: &'a ObjectModel, name: &str) -> &'a Site {
    model.site(name).unwrap_or_else(|| panic!("{} has no site {name}", model.name))
}

#[test]
fn sites_lie_on_the_shapes_or_in_the_open() {
    // Minimum and maximum distance to the nearest shape; on a surface up to rounding.
    const SOLID_M: [f32; 2] = [0.0, 1e-6];
    for (name, sites, [low_m, high_m]) in [
        ("bottle", &["grip_low", "grip_high"][..], SOLID_M),
        ("tub", &["bar_a", "bar_b"], SOLID_M),
        ("frame", &["left_side", "right_side"], SOLID_M),
        ("basket", &["a_left", "a_right", "b_left", "b_right"], SOLID_M),
        ("office_table", &["a_left", "a_right", "b_left", "b_right"], SOLID_M),
        ("console_table", &["b_left", "b_right", "c_left", "c_right"], SOLID_M),
        ("console_table", &["foot_1", "foot_2", "foot_3", "foot_4"], SOLID_M),
        ("round_table", &["a_left", "a_right", "b_left", "b_right", "c_left", "c_right", "foot"], SOLID_M),
        ("bin", &["left", "right"], SOLID_M),
        ("service_trolley", &["left", "right", "ring"], SOLID_M),
        ("wall_peg", &["root", "tip"], SOLID_M),
        ("cup", &["lip"], [0.0, 0.003]),
        // Axes of vessels: the distance to the wall is the inner radius.
        ("cup", &["grip"], [0.030, 0.035]),
        ("glass", &["grip"], [0.028, 0.033]),
        ("glass", &["mouth"], [0.040, 0.047]),
        ("crate", &["inside"], [0.08, 0.09]),
        // A hole of 60 mm minus the part that the chords of its ring cut off.
        ("frame", &["loop"], [0.028, 0.030]),
    ] {
        let model = object(name);
        for name in sites {
            let clearance_m = clearance_m(&model, site(&model, name).position_m());
            let found = format!("{}: {name} is {clearance_m} m from a shape", model.name);
            assert!((low_m..=high_m).contains(&clearance_m), "{found}");
        }
    }
}

#[test]
fn regions_have_the_extent_of_what_they_stand_for() {
    // The corners of the region in the crate touch its walls and its floor, from within.
    let model = object("crate");
    let [low_m, high_m] = site(&model, "inside").corners_m();
    for outwards in [Vector::NEG_X, Vector::X, Vector::NEG_Y, Vector::Y] {
        let middle_m = (low_m + high_m) * 0.5;
        let at_wall_m = middle_m + outwards * ((high_m - low_m) * 0.5);
        assert!(clearance_m(&model, at_wall_m) < 1e-5, "{outwards}");
        assert!(clearance_m(&model, at_wall_m - outwards * 0.01) > 0.005, "{outwards}");
    }
    assert!(low_m.z.abs() < 1e-6, "an apple that lies on the base is inside");
}

#[test]
fn feet_are_as_wide_as_the_legs_that_stand_on_them() {
    let table = object("console_table");
    for name in ["foot_1", "foot_2", "foot_3", "foot_4"] {
        let foot = site(&table, name);
        for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let corner_m = |wider_m: f32| {
                let half_m = foot.size_m + Vector::splat(wider_m);
                foot.position_m() + Vector::new(half_m.x * x, half_m.y * y, 0.0)
            };
            let [inside_m, outside_m] = [-1e-4, 1e-3].map(|wider_m| clearance_m(&table, corner_m(wider_m)));
            assert!(inside_m < 1e-6 && outside_m > 5e-4, "{name}: {inside_m} m, {outside_m} m");
        }
    }
}

#[test]
fn vessels_enclose_what_is_between_their_walls() {
    // The glass widens from 29.2 mm on its floor over 32.0 mm below its flared mouth to 49.0 mm at the
    // rim, the cup from 27 mm to 37 mm.
    for (name, height_m, radius_m) in [
        ("glass", 0.009, 0.0292),
        ("glass", 0.050, 0.0305),
        ("glass", 0.099, 0.0319),
        ("glass", 0.120, 0.0394),
        ("glass", 0.144, 0.0483),
        ("cup", 0.010, 0.0280),
        ("cup", 0.090, 0.0362),
    ] {
        let model = object(name);
        for heading_rad in [0.0, 1.0, 2.5, 4.0] {
            // There are twelve staves: between two of them the wall is up to 3.5 % further away.
            let at_m = |share: f32| {
                let across_m = radius_m * share;
                Vector::new(across_m * f32::cos(heading_rad), across_m * f32::sin(heading_rad), height_m)
            };
            assert!(model.encloses(at_m(0.98)), "{name} at {height_m} m, heading {heading_rad}");
            assert!(!model.encloses(at_m(1.06)), "{name} at {height_m} m, heading {heading_rad}");
            assert!(!model.encloses(at_m(1.5)), "{name} at {height_m} m, heading {heading_rad}");
        }
    }
    let glass = object("glass");
    for (height_m, expected) in
        [(-0.001, false), (0.007, false), (0.009, true), (0.145, true), (0.147, false)]
    {
        assert_eq!(glass.encloses(Vector::Z * height_m), expected, "{height_m} m above the base");
    }
}

#[test]
fn the_lowest_point_is_that_of_the_shape_as_it_lies() {
    use rapier3d::math::{Pose, Rotation};
    let glass = object("glass");
    // Upright on its base, upside down on its rim, and on its side with the rim on the floor.
    for (turn_rad, height_m) in
        [(0.0, 0.0), (std::f32::consts::PI, -0.1464), (std::f32::consts::FRAC_PI_2, -0.0533)]
    {
        let lowest_m = glass.lowest_m(&Pose::from_rotation(Rotation::from_rotation_x(turn_rad)));
        assert!((lowest_m - height_m).abs() < 2e-3, "{lowest_m} m, turned by {turn_rad} rad");
    }
}

/// Objects that several robots carry, or one robot with both hands: their extent along each axis, rims
/// included, and their mass.
const CARRIED: [(&str, [f32; 3], f32); 5] = [
    ("round_table", [0.80, 0.80, 0.74], 3.55),
    ("office_table", [0.90, 0.60, 0.74], 3.4),
    ("console_table", [0.80, 0.52, 0.74], 2.62),
    ("basket", [0.56, 0.41, 0.25], 2.0),
    ("bin", [0.30, 0.17, 0.72], 1.5),
];

#[test]
fn carried_objects_are_held_by_what_they_have() {
    for (name, size_m, mass_kg) in CARRIED {
        let (_, tree) = ObjectModel::read(&name.into()).unwrap_or_else(|error| panic!("{error}"));
        let found_kg = tree.links[0].mass.mass();
        assert!((found_kg - mass_kg).abs() < 0.005, "{name}: {found_kg} kg, and not {mass_kg} kg");
        let file = assets::object(name).unwrap_or_else(|error| panic!("{error}"));
        let names: Vec<&str> =
            file.split("name=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
        for added in ["rail", "handle", "bar", "apron"] {
            assert!(!names.iter().any(|name| name.contains(added)), "{name} has a {added}: {names:?}");
        }
        // No shape extends beyond this, whatever its name is, and whether it collides or not.
        let model = object(name);
        let shapes = model.geoms.iter().filter_map(|geom| geom.collider());
        let bounds =
            shapes.map(|(pose, shape)| shape.compute_aabb(&pose)).reduce(|all, one| all.merged(&one));
        let found_m = bounds.unwrap_or_else(|| panic!("{name} has shapes")).extents();
        let off_m = (found_m - Vector::from(size_m)).abs().max_element();
        assert!(off_m < 0.02, "{name} is {found_m} m large, and not {size_m:?}");
    }
}
