//! Tests of processes that are killed or asked to end in the middle of work, and of those that resume it.

mod brought_back;
mod interrupted;
mod resumed;
mod signals;
