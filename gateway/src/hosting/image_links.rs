//! Images that clients fetch by link. The latest images of an episode are kept in memory.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tandem_tools_spec::{CameraImage, ImageLink, Observation};

/// Maximum number of images kept for an episode.
pub const MAX_LINKED_IMAGES: usize = 24;

/// The linked images of an episode, the latest last.
#[derive(Debug, Default)]
pub struct ImageLinks(Mutex<VecDeque<LinkedImage>>);

/// A linked image.
#[derive(Debug, Clone)]
pub struct LinkedImage {
    /// The robot whose camera took the image.
    pub robot: String,
    /// The PNG file.
    pub png: Arc<[u8]>,
    name: String,
}

impl ImageLinks {
    /// Keeps the images of the observation `seen` of `episode` after `step` control steps, and replaces them
    /// by links.
    pub fn link(&self, episode: &str, step: u32, seen: &mut Observation) {
        let mut kept = self.lock();
        for CameraImage { robot, png_base64 } in std::mem::take(&mut seen.images) {
            let name = format!("{step}-{robot}.png");
            let path = format!("/v1/episodes/{episode}/images/{name}");
            // A second observation of the same step contains the same image.
            kept.retain(|image| image.name != name);
            kept.push_back(LinkedImage { robot: robot.clone(), png: png_base64.0.into(), name });
            seen.links.push(ImageLink { robot, path });
        }
        let surplus = kept.len().saturating_sub(MAX_LINKED_IMAGES);
        kept.drain(..surplus);
    }

    /// Returns the image called `name`, if it is kept.
    pub fn find(&self, name: &str) -> Option<LinkedImage> {
        self.lock().iter().find(|image| image.name == name).cloned()
    }

    /// Removes all images.
    pub fn clear(&self) {
        *self.lock() = VecDeque::new();
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<LinkedImage>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use tandem_tools_spec::Png;

    use super::*;

    fn seen(robots: &[&str]) -> Observation {
        let image =
            |robot: &&str| CameraImage { robot: (*robot).into(), png_base64: Png(robot.as_bytes().into()) };
        let images = robots.iter().map(image).collect();
        Observation {
            time_s: 6.0,
            states: Vec::new(),
            cameras: Vec::new(),
            images,
            links: Vec::new(),
            depth_images: Vec::new(),
            arrays: Vec::new(),
        }
    }

    #[test]
    fn the_latest_images_are_kept() {
        let links = ImageLinks::default();
        let mut first = seen(&["A", "B"]);
        links.link("x", 300, &mut first);
        let paths: Vec<&str> = first.links.iter().map(|link| link.path.as_str()).collect();
        assert_eq!(paths, ["/v1/episodes/x/images/300-A.png", "/v1/episodes/x/images/300-B.png"]);
        assert!(first.images.is_empty());
        let found = links.find("300-B.png").unwrap();
        assert_eq!((found.robot.as_str(), &*found.png), ("B", &b"B"[..]));
        // A second observation of the same step drops no image.
        (0..MAX_LINKED_IMAGES).for_each(|_| links.link("x", 300, &mut seen(&["A"])));
        assert!(links.find("300-B.png").is_some());
        (1..MAX_LINKED_IMAGES as u32).for_each(|step| links.link("x", 300 + step, &mut seen(&["A"])));
        assert!(links.find("300-B.png").is_none());
        assert!(links.find("300-A.png").is_some() && links.find("301-A.png").is_some());
        links.link("x", 400, &mut seen(&["A"]));
        assert!(links.find("300-A.png").is_none() && links.find("400-A.png").is_some());
        links.clear();
        assert!(links.find("400-A.png").is_none());
    }
}
