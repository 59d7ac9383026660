//! End-to-end tests of Tandem, mostly over HTTP. They form one program, because linking a program takes
//! seconds. Run some of them by name: `cargo test --workspace --release --test end_to_end experts`.

mod documents;
mod episodes;
mod notes;
mod operators;
mod paper_numbers;
mod policies;
mod server;
mod skips;
mod watching;
