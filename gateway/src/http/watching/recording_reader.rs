//! The thread that reads recordings for watchers of finished episodes. It keeps the last recording in memory.
//!
//! A recording takes tens of megabytes while it is read, and an allocator keeps freed memory for the
//! thread that had requested it. With many reading threads, each would keep that much.

use std::{
    fmt, fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    thread,
    time::SystemTime,
};

use axum::{body::Bytes, http::StatusCode};
use tandem_episodes::replay::RecordedEpisode;
use tokio::sync::{mpsc, oneshot};

use crate::http::problem::ApiError;

/// Name of a recording in an episode's folder.
pub const RECORDING: &str = "episode.mcap";

/// Number of queued jobs beyond which callers wait.
const WAITING: usize = 16;

type ReadingJob = Box<dyn FnOnce(&mut LastOpened) + Send>;

/// Queue of reading jobs, which run one after another.
#[derive(Clone)]
pub struct RecordingReader(mpsc::Sender<ReadingJob>);

impl fmt::Debug for RecordingReader {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.write_str("RecordingReader(..)")
    }
}

impl RecordingReader {
    /// Starts a reader. Its thread ends with the last clone.
    pub fn start() -> RecordingReader {
        let (jobs, mut inbox) = mpsc::channel::<ReadingJob>(WAITING);
        thread::spawn(move || {
            let mut last = LastOpened::default();
            while let Some(job) = inbox.blocking_recv() {
                // The caller of a job that panics receives an error, because its reply is dropped.
                if catch_unwind(AssertUnwindSafe(|| job(&mut last))).is_err() {
                    last = LastOpened::default();
                }
            }
        });
        RecordingReader(jobs)
    }

    /// Runs `work` on the thread when its turn comes, unless the caller has disconnected by then.
    pub async fn read<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut LastOpened) -> Result<T, ApiError> + Send + 'static,
    ) -> Result<T, ApiError> {
        let (reply, answer) = oneshot::channel();
        let job: ReadingJob = Box::new(move |last| {
            if !reply.is_closed() {
                let _ = reply.send(work(last));
            }
        });
        self.0.send(job).await.map_err(|gone| ApiError::Reply(gone.to_string().into()))?;
        answer.await.map_err(|failed| ApiError::Reply(failed.into()))?
    }
}

/// The recording that was viewed last. It is kept because a page requests many images of one recording.
#[derive(Default)]
pub struct LastOpened(Option<OpenedRecording>);

/// A recording in memory, with its path and modification time.
pub struct OpenedRecording {
    path: PathBuf,
    changed: SystemTime,
    pub episode: RecordedEpisode,
}

impl OpenedRecording {
    /// Returns the message from which pages draw the episode. All requests share it.
    pub fn message(&self) -> Bytes {
        Bytes::from_owner(self.episode.message())
    }
}

impl LastOpened {
    /// Returns the recording in an episode's folder. The file is read only if it is not the last one, or has
    /// changed.
    pub fn open(&mut self, folder: &Path) -> Result<&OpenedRecording, ApiError> {
        let path = folder.join(RECORDING);
        let changed = fs::metadata(&path).and_then(|file| file.modified());
        let changed = changed.map_err(|_| no_recording(folder))?;
        // The previous recording is dropped first, so that two are never in memory at once.
        let last = self.0.take().filter(|opened| opened.path == path && opened.changed == changed);
        let opened = match last {
            Some(opened) => opened,
            None => {
                let episode = RecordedEpisode::read(&path).map_err(|error| unreadable(&error))?;
                OpenedRecording { path, changed, episode }
            }
        };
        Ok(self.0.insert(opened))
    }
}

/// Returns the refusal for a missing file of an episode.
pub fn no_recording(folder: &Path) -> ApiError {
    ApiError::NoRun { run: folder.file_name().unwrap_or_default().to_string_lossy().into_owned() }
}

/// Returns the refusal for an unusable recording.
pub fn unreadable(error: &dyn std::error::Error) -> ApiError {
    let status = StatusCode::UNPROCESSABLE_ENTITY;
    ApiError::Protocol { status, detail: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn all_is_read_on_one_thread_and_a_panic_stops_only_who_caused_it() {
        let reader = RecordingReader::start();
        let here = |_: &mut LastOpened| Ok(thread::current().id());
        let first = reader.read(here).await.expect("an answer");
        assert_ne!(first, thread::current().id());
        let broken =
            reader.read(|_: &mut LastOpened| -> Result<(), ApiError> { panic!("a broken file") }).await;
        assert!(matches!(broken, Err(ApiError::Reply(_))), "{broken:?}");
        let many: Vec<_> = (0..3 * WAITING)
            .map(|_| {
                tokio::spawn({
                    let reader = reader.clone();
                    async move { reader.read(here).await }
                })
            })
            .collect();
        for one in many {
            assert_eq!(one.await.expect("no panic").expect("an answer"), first);
        }
    }
}
