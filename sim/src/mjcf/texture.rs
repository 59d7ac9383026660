//! Pictures that an MJCF file lays on materials. Only their colour is taken.

use std::collections::BTreeMap;
use std::path::Path;

use image::ImageReader;

use super::Document;
use crate::SimError;

impl Document {
    /// The mean colours of the textures that its assets name files of.
    pub(super) fn read_textures(&self) -> Result<BTreeMap<String, [f32; 3]>, SimError> {
        let mut found = BTreeMap::new();
        for asset in &self.model.assets.textures {
            if let Some(path) = self.model.resolve_texture_file(asset, &self.folder) {
                found.insert(asset.name.clone().unwrap_or_default(), mean_rgb(&path)?);
            }
        }
        Ok(found)
    }
}

fn mean_rgb(path: &Path) -> Result<[f32; 3], SimError> {
    let name = || path.display().to_string();
    let reader = ImageReader::open(path).map_err(|source| SimError::Read { path: name(), source })?;
    let picture = reader.decode().map_err(|source| SimError::Texture { path: name(), source })?.into_rgb8();
    let mut sum = [0.0f64; 3];
    for pixel in picture.pixels() {
        for (sum, value) in sum.iter_mut().zip(pixel.0) {
            *sum += f64::from(value) / 255.0;
        }
    }
    Ok(sum.map(|sum| (sum / picture.pixels().len().max(1) as f64) as f32))
}
