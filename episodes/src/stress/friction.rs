//! Objects are slippery: their surfaces leave only a share of the friction with hands, with each other and with what they stand on, as
//! where they are wet or greasy. The soles of robots hold as ever.

use tandem_sim::World;

use super::StressLevel;
use crate::tasks::Task;

/// What is left. Rubber pads on dry wood or steel have 0.8, and wet ones about half of it.
const LEFT: [f64; 3] = [0.85, 0.7, 0.55];

pub fn alter(world: &mut World, task: &Task, level: StressLevel) {
    for spot in task.objects {
        world.leave_friction(spot.name, level.of(LEFT));
    }
}
