//! Episodes in which each robot has an operator of its own.

mod driving;
mod page;
mod partners;
mod plans;
mod processes;
mod restarts;
mod rounds;
mod team;
