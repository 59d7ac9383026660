//! Explanations, in sentences, of why a fact does not hold.

use tandem_sim::Side;

use crate::scoring::placement::{RELEASE_S, STILL_M_S, STILL_RAD_S, UPRIGHT_RAD};
use crate::scoring::{Facts, Grip, ROBOT_NAMES};

/// Explains why a robot does not hold `object` with any hand on these sides; empty if it does.
pub fn grip(f: &Facts, robot: usize, sides: &[Side], object: &str) -> Vec<String> {
    let hands = f.object(object).hands[robot];
    if sides.iter().any(|side| hands[*side] == Grip::Holding) {
        return Vec::new();
    }
    let does = |side: &Side| match hands[*side] {
        Grip::Off => format!("the {} one is off it", side.name()),
        Grip::Touching | Grip::Holding => format!("the {} one touches it from one side alone", side.name()),
    };
    let (robot, does) = (ROBOT_NAMES[robot], sides.iter().map(does).collect::<Vec<_>>().join(", "));
    match sides {
        [side] => vec![format!("{robot}'s {} hand does not hold {object}: {does}", side.name())],
        _ => vec![format!("no hand of {robot} holds {object}: {does}")],
    }
}

/// Lists the hands of a robot that are on `object`, one sentence each.
pub fn hands_off(f: &Facts, robot: usize, object: &str) -> Vec<String> {
    let hands = f.object(object).hands[robot];
    let on = Side::BOTH.into_iter().filter(|side| hands[*side] != Grip::Off);
    on.map(|side| format!("{}'s {} hand is still on {object}", ROBOT_NAMES[robot], side.name())).collect()
}

/// Explains why an object is not upright, still and released.
pub fn stands_released(f: &Facts, object: &str) -> Vec<String> {
    let mut found: Vec<String> = (0..f.robots.len()).flat_map(|robot| hands_off(f, robot, object)).collect();
    let untouched_s = f.untouched_s(object);
    if untouched_s < RELEASE_S && found.is_empty() {
        found.push(format!("{object} has been untouched for {untouched_s:.2} s, {RELEASE_S} are asked for"));
    }
    let mut at_most = |what: &str, value: f32, most: f32, unit: &str, digits: usize| {
        if value > most {
            found.push(format!("{object} {what} {value:.digits$} {unit}, at most {most:.digits$}"));
        }
    };
    at_most("leans by", f.tilt_rad(object).to_degrees(), UPRIGHT_RAD.to_degrees(), "degrees", 1);
    at_most("moves at", f.speed_m_s(object), STILL_M_S, "m/s", 2);
    at_most("turns at", f.turn_rate_rad_s(object), STILL_RAD_S, "rad/s", 2);
    found
}

/// Describes the change of an object's height since the start.
pub fn stands_as_high(f: &Facts, object: &str, within_m: f32) -> Vec<String> {
    let lift_m = f.lift_m(object);
    let (by_m, way) = (lift_m.abs(), if lift_m > 0.0 { "higher" } else { "lower" });
    vec![format!("{object} is {by_m:.3} m {way} than at the start, at most {within_m}")]
}

/// Describes the distance between two objects along each axis on which it exceeds `half_m`. The z axis counts
/// if `also_high` is set.
pub fn apart(f: &Facts, object: &str, target: &str, half_m: f32, also_high: bool) -> Vec<String> {
    let apart_m = f.position_m(object) - f.position_m(target);
    let axes = [("x", apart_m.x), ("y", apart_m.y), ("z", if also_high { apart_m.z } else { 0.0 })];
    let farther = axes.into_iter().filter(|(_, by_m)| by_m.abs() > half_m);
    let by: Vec<String> = farther.map(|(axis, by_m)| format!("{:.3} m along {axis}", by_m.abs())).collect();
    vec![format!("{object} is {} from {target}, at most {half_m}", by.join(" and "))]
}
