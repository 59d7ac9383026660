//! Tests of processes that are killed or asked to end during their work, and of processes that resume it.

mod brought_back;
mod interrupted;
mod resumed;
mod signals;
