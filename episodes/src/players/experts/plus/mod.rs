//! Experts of the suite tandem+. They know what the seed has chosen, which robots that play the task would have to tell each other; the
//! player without words is handed another choice in its place.

mod blind_carry;
mod relay;
mod set_the_table;
mod swap;
mod which_one;

use super::ExpertScript;

pub const ALL: &[(&str, ExpertScript)] = &[
    ("which_one", which_one::perform),
    ("blind_carry", blind_carry::perform),
    ("relay", relay::perform),
    ("set_the_table", set_the_table::perform),
    ("swap", swap::perform),
];
