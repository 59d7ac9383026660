//! The queue of jobs for the thread of an episode. A job resumes a suspended episode.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tandem_episodes::Session;
use tokio::sync::{mpsc, oneshot};

use super::{
    desk::{Desk, Job, Outcome},
    stage::Stage,
    work::{self, Opening},
};
use crate::hosting::HostingError;

/// Maximum number of calls that may wait for one episode. A policy makes one call at a time; the remaining
/// capacity absorbs bursts.
pub const WAITING_CALLS: usize = 16;

/// Sending end of the queue.
#[derive(Debug)]
pub struct JobQueue {
    jobs: Mutex<mpsc::Sender<Job>>,
    stage: Arc<Stage>,
}

impl JobQueue {
    /// Creates the queue with the sender `jobs` to the thread that plays the episode of `stage`.
    pub fn new(stage: Arc<Stage>, jobs: mpsc::Sender<Job>) -> JobQueue {
        JobQueue { jobs: Mutex::new(jobs), stage }
    }

    /// Returns true if the thread has ended.
    pub fn is_closed(&self) -> bool {
        self.lock().is_closed()
    }

    /// Runs `work` in its turn. Returns an error if too many jobs are waiting already.
    pub async fn work_unless_full<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Desk) -> Outcome<T> + Send + 'static,
    ) -> Outcome<T> {
        let (job, outcome) = job(work);
        self.send(job)?;
        outcome.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Runs `work` in its turn, however many jobs are waiting.
    pub async fn work<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Desk) -> Outcome<T> + Send + 'static,
    ) -> Outcome<T> {
        let (job, outcome) = job(work);
        self.send_in_turn(job).await?;
        outcome.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Runs `work` on the session in its turn.
    pub async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Session) -> Outcome<T> + Send + 'static,
    ) -> Outcome<T> {
        self.work(|desk| desk.run(work)).await
    }

    /// Runs `work` on the session, for threads outside the async runtime. Returns an error if too many jobs
    /// are waiting already.
    pub fn run_blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Session) -> Outcome<T> + Send + 'static,
    ) -> Outcome<T> {
        let (job, outcome) = job(|desk| desk.run(work));
        self.send(job)?;
        outcome.blocking_recv().map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Queues a job, however many are waiting.
    pub async fn send_in_turn(&self, mut job: Job) -> Result<(), HostingError> {
        // The episode may be suspended after `sender` has returned.
        while let Err(mpsc::error::SendError(unsent)) = self.sender()?.send(job).await {
            job = unsent;
        }
        Ok(())
    }

    /// Queues a job if no other job waits.
    pub fn send_if_idle(&self, job: Job) {
        let jobs = self.lock();
        if jobs.capacity() == jobs.max_capacity() {
            // The error of an episode that has stopped meanwhile is ignored.
            let _ = jobs.try_send(job);
        }
    }

    /// Queues a job. Blocks while the queue is full, so it must not be called from async code.
    pub fn send_blocking(&self, job: Job) {
        // The error of an episode that has stopped meanwhile is ignored.
        if let Ok(jobs) = self.sender() {
            let _ = jobs.blocking_send(job);
        }
    }

    /// Queues a job. Returns an error if too many jobs are waiting already.
    pub fn send(&self, mut job: Job) -> Result<(), HostingError> {
        loop {
            job = match self.sender()?.try_send(job) {
                Ok(()) => return Ok(()),
                Err(mpsc::error::TrySendError::Full(_)) => {
                    return Err(HostingError::TooManyWaiting { limit: WAITING_CALLS });
                }
                Err(mpsc::error::TrySendError::Closed(unsent)) => unsent,
            };
        }
    }

    /// Returns the sender to the episode's thread. Starts the thread if the episode is suspended.
    fn sender(&self) -> Result<mpsc::Sender<Job>, HostingError> {
        self.stage.status.is_used();
        let mut jobs = self.lock();
        if jobs.is_closed() {
            let sleep = self.stage.status.wake_up().ok_or(HostingError::EpisodeStopped)?;
            let (awake, inbox) = mpsc::channel(WAITING_CALLS);
            let opening = Opening::Again { thinking: sleep.thinking() };
            if let Err(error) = work::spawn(self.stage.clone(), opening, inbox) {
                self.stage.status.sleep_on(sleep);
                return Err(error);
            }
            *jobs = awake;
        }
        Ok(jobs.clone())
    }

    fn lock(&self) -> MutexGuard<'_, mpsc::Sender<Job>> {
        // Nothing panics while it holds the lock.
        self.jobs.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Wraps `work` in a job, and returns the job with the receiver of its outcome.
pub fn job<T: Send + 'static>(
    work: impl FnOnce(&mut Desk) -> Outcome<T> + Send + 'static,
) -> (Job, oneshot::Receiver<Outcome<T>>) {
    let (reply, outcome) = oneshot::channel();
    // The outcome is dropped if the caller has stopped waiting; the work keeps its effect.
    (Box::new(move |desk| drop(reply.send(desk.and_then(work)))), outcome)
}
