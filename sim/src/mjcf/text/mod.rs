//! From the text of a file, with all that it includes, to the model that `mjcf-rs` reads, and what that reads past.

pub mod check;
pub mod plain;
pub mod settings;
pub mod source;
pub mod split;
pub mod stated;
