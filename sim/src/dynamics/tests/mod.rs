//! Tests against closed forms, conservation laws and exact reruns.

pub mod bench;
mod contacts;
mod drives;
mod energy_balance;
mod exactness;
mod free_motion;
mod friction;
mod inverse;
mod joints;
mod overlap;
mod rim;
