//! The whole of Tandem, mostly over HTTP. One program, because each that is linked costs seconds; a test of it by name:
//! `cargo test --release -p tandem-tests --test end_to_end experts`.

mod documents;
mod episodes;
mod operators;
mod paper_numbers;
mod policies;
mod server;
