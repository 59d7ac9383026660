//! Friction stress: objects are slippery, as if wet or greasy. Their friction with hands, with each other
//! and with their supports is reduced to a share. The soles of robots are unchanged.

use tandem_sim::World;

use super::StressLevel;
use crate::tasks::Task;

/// Remaining share of friction. Rubber pads on dry wood or steel have a coefficient of 0.8, and wet ones
/// about half as much.
const LEFT: [f64; 3] = [0.85, 0.7, 0.55];

pub fn alter(world: &mut World, task: &Task, level: StressLevel) {
    for spot in &task.objects {
        world.leave_friction(&spot.name, level.of(LEFT));
    }
}
