//! Conversion of a file's text, with all its includes, to the model of `mjcf-rs` and to the parts that
//! `mjcf-rs` does not read.

pub mod check;
pub mod plain;
pub mod replicate;
pub mod settings;
pub mod source;
pub mod split;
pub mod stated;
