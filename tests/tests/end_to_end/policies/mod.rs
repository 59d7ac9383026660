//! Tests of external policies: programs that are started for an episode, and learned policies on servers.

pub mod act_server;
mod cheats;
mod kinds;
mod openpi_server;
pub mod plans;
mod programs;
mod servers;
mod trouble;
mod xpolicylab;
mod xpolicylab_server;
