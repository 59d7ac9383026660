//! Both sides of the thresholds that placements share.

use tandem_sim::Vector;

use crate::scoring::{Facts, ObjectFacts};

/// `placed` a little inside and a little outside of how slow `object` has to be, and of how long hands have to be off it.
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
        ("hands", untouched(0.2), untouched(0.18)),
    ]
}
