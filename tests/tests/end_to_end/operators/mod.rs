//! Episodes in which each robot has an operator of its own.

mod driving;
mod page;
mod partners;
mod processes;
mod rounds;
mod team;
