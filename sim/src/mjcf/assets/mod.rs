//! Assets of a file and their appearance: meshes, images, layers of materials, gloss, patterns and groups, and
//! a cache of documents.

mod concave;
pub mod files;
pub mod gloss;
mod images;
pub mod kept;
pub mod layers;
pub mod looks;
pub mod surface;
pub mod texture;
