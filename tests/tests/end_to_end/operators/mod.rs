//! Tests of episodes with an operator for each robot.

mod clocks;
mod driving;
mod page;
mod partners;
mod plans;
mod processes;
mod restarts;
mod rounds;
mod team;
