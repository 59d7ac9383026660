//! Surface images of the scenes that pages have drawn, by their hashes.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError, Weak},
};

use tandem_episodes::live::LiveTexture;

/// Surface images of the scenes in use. An image is dropped with its scene.
#[derive(Debug, Clone, Default)]
pub struct KnownTextures(Arc<Mutex<HashMap<String, Weak<LiveTexture>>>>);

impl KnownTextures {
    /// Adds the surface images of a scene that a page is about to draw.
    pub fn add(&self, textures: &[Arc<LiveTexture>]) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|_, texture| texture.strong_count() > 0);
        known.extend(textures.iter().map(|texture| (texture.hash().to_owned(), Arc::downgrade(texture))));
    }

    /// Returns the image with this hash, as long as a scene uses it.
    pub fn find(&self, hash: &str) -> Option<Arc<LiveTexture>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get(hash)?.upgrade()
    }
}
