//! Tests of the whole of Tandem, mostly over HTTP. They are one program, because linking each takes seconds.
//! Some of them are run by name: `cargo test --workspace --release --test end_to_end experts`.

mod documents;
mod episodes;
mod notes;
mod operators;
mod paper_numbers;
mod policies;
mod server;
mod skips;
mod watching;
