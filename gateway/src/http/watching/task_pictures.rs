//! Pictures of the tasks for the start page, each rendered at its first request.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use tandem_episodes::{
    EpisodeSpec,
    replay::{PictureSize, start_picture},
    tasks::Task,
};
use tandem_tools_spec::Protocol;

use crate::{hosting::HostingError, http::problem::ApiError};

/// Seed of the pictured start, which belongs to no evaluation.
const PICTURED_SEED: u32 = 2000;

/// Size of a picture.
const SIZE: PictureSize = PictureSize { width: 640, height: 400 };

/// A PNG file.
type PngBytes = Arc<[u8]>;

/// The pictures rendered so far, by task.
#[derive(Debug, Clone, Default)]
pub struct TaskPictures(Arc<Mutex<BTreeMap<String, PngBytes>>>);

impl TaskPictures {
    /// Returns the picture of a task as a PNG file. Callers wait for each other, so that at most one
    /// picture is rendered at a time.
    pub fn of(&self, task: &Task) -> Result<PngBytes, ApiError> {
        let mut drawn = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(picture) = drawn.get(&task.id) {
            return Ok(picture.clone());
        }
        let spec = EpisodeSpec::new(task, PICTURED_SEED, Protocol::Benchmark);
        let picture = start_picture(&spec, SIZE).map_err(HostingError::from)?;
        drawn.insert(task.id.clone(), picture.clone());
        Ok(picture)
    }
}

#[cfg(test)]
mod tests {
    use tandem_episodes::tasks;

    use super::*;

    #[test]
    fn a_task_is_drawn_once() {
        let pictures = TaskPictures::default();
        let task = tasks::find("table_align").unwrap();
        let first = pictures.of(&task).unwrap();
        assert!(first.starts_with(b"\x89PNG") && first.len() > 20_000, "{} bytes", first.len());
        assert!(Arc::ptr_eq(&first, &pictures.of(&task).unwrap()));
    }
}
