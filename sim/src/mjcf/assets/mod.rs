//! Assets of a file and their appearance: meshes, images, patterns and groups, and a cache of documents.

mod builtin;
mod concave;
pub mod files;
mod images;
pub mod kept;
pub mod looks;
pub mod surface;
pub mod texture;
