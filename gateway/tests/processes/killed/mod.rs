//! Processes that are killed or asked to end under way, and those that go on.

mod brought_back;
mod interrupted;
mod resumed;
mod signals;
