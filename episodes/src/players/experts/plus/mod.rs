//! Experts of the suite tandem+. They know the seed's choices, which the robots of the task would have to
//! communicate. The player `no_words` gets another draw of the choices instead.

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
