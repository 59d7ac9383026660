//! Tests at both sides of every threshold of the benchmark's tasks.

use super::{PhaseSetting, find};
use crate::scoring::{Facts, Predicate};

/// Defines `task()` and a function for each condition, from `name = phase setting`. An index in brackets
/// selects among several conditions of the same setting.
macro_rules! conditions {
    ($task:literal: $($name:ident = $phase:literal $setting:ident $([$index:literal])?,)*) => {
        fn task() -> $crate::tasks::Task {
            $crate::tasks::find($task).unwrap()
        }

        $(
            fn $name(facts: &$crate::scoring::Facts) -> bool {
                let index = [0 $(, $index)?].into_iter().max().unwrap();
                super::holds($task, $phase, $crate::tasks::PhaseSetting::$setting, index, facts)
            }
        )*
    };
}

mod big_table;
mod cart_service;
mod co_carry;
mod co_pouring;
mod frame_hang;
mod handover;
mod move_house;
mod pouring;
mod table_align;
mod trash_collection;

/// Returns true if the condition number `index` among those of this phase and setting holds.
fn holds(task: &str, phase: usize, setting: PhaseSetting, index: usize, facts: &Facts) -> bool {
    let conditions = &find(task).unwrap().conditions[phase];
    let condition = conditions.iter().filter(|condition| condition.setting == setting).nth(index).unwrap();
    condition.truth.holds(facts)
}
