//! What a file names and what is drawn of it: meshes, pictures, patterns and groups; kept for the next who asks.

mod concave;
pub mod files;
pub mod kept;
pub mod looks;
