//! Conditions on placed objects that tasks share.

use crate::scoring::Facts;

/// Time without touch by any part of a robot after which an object counts as released.
pub const RELEASE_S: f64 = 0.2;
/// Maximum tilt of a placed object.
pub const UPRIGHT_RAD: f32 = 15.0 * std::f32::consts::PI / 180.0;
/// Maximum speed of a placed object.
pub const STILL_M_S: f32 = 0.05;
/// Maximum angular speed of a placed object.
pub const STILL_RAD_S: f32 = 0.15;

/// Returns `true` if no robot has touched `object` for 0.2 s, and it is upright and still.
pub fn stands_released(f: &Facts, object: &str) -> bool {
    f.untouched_s(object) >= RELEASE_S
        && f.tilt_rad(object) <= UPRIGHT_RAD
        && f.speed_m_s(object) <= STILL_M_S
        && f.turn_rate_rad_s(object) <= STILL_RAD_S
}

/// Returns `true` if `object` is within `half_m` of `target` on each axis of the world.
pub fn within_box(f: &Facts, object: &str, target: &str, half_m: f32) -> bool {
    let apart = f.position_m(object) - f.position_m(target);
    apart.abs().max_element() <= half_m
}

/// Returns `true` if `object` is within `half_m` of `target` on both horizontal axes of the world.
pub fn above_box(f: &Facts, object: &str, target: &str, half_m: f32) -> bool {
    let apart = f.position_m(object) - f.position_m(target);
    apart.truncate().abs().max_element() <= half_m
}

/// Returns `true` if the origin of `object` is within `within_m` of its initial height.
pub fn stands_as_high(f: &Facts, object: &str, within_m: f32) -> bool {
    f.lift_m(object).abs() <= within_m
}

/// Both sides of the thresholds that placements share.
#[cfg(test)]
pub mod sides {
    use tandem_sim::Vector;

    use crate::scoring::{Facts, ObjectFacts};

    /// Returns facts a little inside and a little outside of the limits of speed, angular speed and release
    /// time for `object`.
    pub fn still_and_released(placed: &Facts, object: &str) -> [(&'static str, Facts, Facts); 3] {
        let changed = |change: &dyn Fn(&mut ObjectFacts)| {
            let mut facts = placed.clone();
            change(facts.object_mut(object));
            facts
        };
        let fast = |m_s: f32| changed(&|object| object.velocity_m_s = Vector::X * m_s);
        let turning = |rad_s: f32| changed(&|object| object.angular_velocity_rad_s = Vector::Z * rad_s);
        let untouched = |for_s: f64| changed(&|object| object.untouched_s = for_s);
        [
            ("speed", fast(0.0499), fast(0.0501)),
            ("turning", turning(0.1499), turning(0.1501)),
            ("release", untouched(0.2), untouched(0.18)),
        ]
    }
}
