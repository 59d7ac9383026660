//! The wire contract, as hosts and policies read it.

mod faces;
mod goldens;
mod python;
mod schemas;
