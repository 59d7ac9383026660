//! Episodes in which each robot has an operator of its own.

mod processes;
mod rounds;
mod team;
