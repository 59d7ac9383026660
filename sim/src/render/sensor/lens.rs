//! Map from the pixels of a sensor to rays and to the pixels of an ideal image. It depends on the lens alone.

use std::sync::{Arc, Mutex, PoisonError};

use crate::render::Intrinsics;

/// Number of cached maps, most recently used first. Each image size needs one map.
const KEPT: usize = 4;

static MAPS: Mutex<Vec<Arc<LensMap>>> = Mutex::new(Vec::new());

/// Rays and nearest pixels of a lens, pixel by pixel.
pub struct LensMap {
    pub lens: Intrinsics,
    /// Rays through the pixels as in [`crate::render::Distortion`]: all x, then all y.
    pub pixel_ray: [Vec<f32>; 2],
    /// Index of the nearest pixel of the ideal image.
    pub nearest: Vec<u32>,
}

impl LensMap {
    /// Returns the map of a lens from a shared cache.
    pub fn of(lens: &Intrinsics) -> Arc<LensMap> {
        let mut kept = MAPS.lock().unwrap_or_else(PoisonError::into_inner);
        let place = kept.iter().position(|map| map.lens == *lens);
        let map = place.map_or_else(|| Arc::new(LensMap::new(*lens)), |place| kept.remove(place));
        kept.insert(0, map.clone());
        kept.truncate(KEPT);
        map
    }

    fn new(lens: Intrinsics) -> LensMap {
        let Intrinsics { width, height, focal_px, cx, cy, distortion } = lens;
        let mut map = LensMap { lens, pixel_ray: [Vec::new(), Vec::new()], nearest: Vec::new() };
        for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
            let [x, y] =
                distortion.undistorted([(column as f32 - cx) / focal_px, (row as f32 - cy) / focal_px]);
            // A cast clamps negative indices to the first pixel.
            let [left, above] = [focal_px * x + cx, focal_px * y + cy].map(|px| (px + 0.5) as u32);
            map.pixel_ray[0].push(x);
            map.pixel_ray[1].push(y);
            map.nearest.push(above.min(height - 1) * width + left.min(width - 1));
        }
        map
    }

    /// Samples an ideal image at the nearest pixel of each sensor pixel, for a camera at rest. Values are not
    /// blended.
    pub fn nearest_of<T: Copy>(&self, ideal: &[T]) -> Vec<T> {
        self.nearest.iter().map(|pixel| ideal[*pixel as usize]).collect()
    }
}
