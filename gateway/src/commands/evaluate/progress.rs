//! Progress of an evaluation: a bar on a terminal, or a line in the log every minute.

use std::{
    sync::{Mutex, MutexGuard, mpsc},
    thread,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};
use tandem_evaluation::evaluation::{EpisodeEvent, EvaluationPlan};
use tandem_evaluation::results::PlayedEpisode;

/// Interval between two checks for pending output.
const TICK: Duration = Duration::from_secs(1);

/// Interval between two progress lines in the log.
const LINE_EVERY: Duration = Duration::from_secs(60);

/// Delays of the log lines about a wait for the policy: the first delay, and the interval after that. After a
/// minute, the interval is a minute.
const WAIT_FIRST: Duration = Duration::from_secs(2);
const WAIT_EVERY: Duration = Duration::from_secs(10);

/// Runs `work` with a callback for events of episodes, and reports the progress of the episodes of `plan`
/// while it runs.
pub fn with_progress<T>(plan: &EvaluationPlan, work: impl FnOnce(&(dyn Fn(EpisodeEvent) + Sync)) -> T) -> T {
    let tally = Mutex::new(Tally { planned: plan.episodes().0.len(), ..Tally::default() });
    let lock = || -> MutexGuard<'_, Tally> {
        // The counts stay valid even if a thread panics while it holds the lock.
        tally.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    };
    let began = Instant::now();
    let bar = ProgressBar::new(lock().planned as u64).with_style(style());
    let (working, done) = mpsc::channel::<()>();
    thread::scope(|scope| {
        let (lock, bar) = (&lock, &bar);
        scope.spawn(move || {
            let mut schedule = Schedule::default();
            while done.recv_timeout(TICK) == Err(mpsc::RecvTimeoutError::Timeout) {
                let elapsed = began.elapsed();
                let wait = plan.player.waiting();
                if bar.is_hidden() {
                    schedule.due(elapsed, wait.as_ref().map(|wait| wait.lasted)).for_each(|line| {
                        match (line, &wait) {
                            (DueLine::Wait, Some(wait)) => tracing::info!("{wait}"),
                            (DueLine::Wait, None) => {}
                            (DueLine::Progress, _) => tracing::info!("{}", lock().line(elapsed)),
                        }
                    });
                } else {
                    let waiting = wait.filter(|wait| wait.lasted >= TICK).map(|wait| wait.to_string());
                    bar.set_message(waiting.unwrap_or_else(|| lock().bar_text(elapsed)));
                }
            }
        });
        let result = work(&|event| {
            let mut tally = lock();
            tally.count(event);
            bar.set_position(tally.done() as u64);
            bar.set_message(tally.bar_text(began.elapsed()));
        });
        drop(working);
        bar.finish_and_clear();
        result
    })
}

fn style() -> ProgressStyle {
    // The default is used only if the template is invalid.
    ProgressStyle::with_template("  [{bar:30}] {pos} of {len} episodes, {elapsed}, {msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Counts of the episodes that are done.
#[derive(Debug, Default)]
struct Tally {
    planned: usize,
    /// Number of episodes that an earlier run has played.
    kept: usize,
    /// Number of episodes that this run has played or tried to play.
    played: usize,
    left_out: usize,
    /// Number of episodes of this and the earlier run that do not count.
    excluded: usize,
    /// Number of episodes that count and have not succeeded.
    failed: usize,
    last: String,
}

impl Tally {
    fn count(&mut self, event: EpisodeEvent) {
        match event {
            EpisodeEvent::Kept(episode) => {
                self.kept += 1;
                self.count_outcome(episode);
            }
            EpisodeEvent::Played(episode) => {
                self.played += 1;
                self.count_outcome(episode);
            }
            EpisodeEvent::LeftOut => self.left_out += 1,
        }
    }

    fn count_outcome(&mut self, episode: &PlayedEpisode) {
        self.excluded += usize::from(!episode.counts());
        self.failed += usize::from(episode.counts() && !episode.succeeded());
        self.last = format!("{} seed {}", episode.result.task, episode.spec.seed);
    }

    fn done(&self) -> usize {
        self.kept + self.played + self.left_out
    }

    /// Estimates the remaining time from the pace of this run; `None` before its first episode.
    fn left(&self, elapsed: Duration) -> Option<Duration> {
        let left = self.planned.saturating_sub(self.done()) as f64;
        (self.played > 0).then(|| elapsed.mul_f64(left / self.played as f64))
    }

    /// Returns the line for the log.
    fn line(&self, elapsed: Duration) -> String {
        let counts = [
            (self.failed, "failed"),
            (self.excluded, "not counted because the policy or the simulator failed"),
            (self.left_out, "left out"),
        ];
        let counts = counts.into_iter().filter(|(count, _)| *count > 0);
        let counts: Vec<String> = counts.map(|(count, what)| format!("{count} {what}")).collect();
        let of_them = if counts.is_empty() { String::new() } else { format!(" ({})", counts.join(", ")) };
        let left = self.planned.saturating_sub(self.done());
        let time = match self.left(elapsed) {
            Some(time) => format!("about {} at this pace", in_words(time)),
            None => "no pace known yet".into(),
        };
        format!("{} of {} episodes done{of_them}, {left} left, {time}", self.done(), self.planned)
    }

    /// Returns the text beside the bar.
    fn bar_text(&self, elapsed: Duration) -> String {
        let left = self.left(elapsed).map(|time| format!("about {} left", in_words(time)));
        let last = (!self.last.is_empty()).then(|| self.last.clone());
        left.into_iter().chain(last).collect::<Vec<_>>().join(", ")
    }
}

/// Formats a time for people, for example `40 s`, `12 min` or `3 h 5 min`.
fn in_words(time: Duration) -> String {
    let seconds = time.as_secs_f64().round() as u64;
    let minutes = (seconds + 30) / 60;
    match seconds {
        0..90 => format!("{seconds} s"),
        90..5400 => format!("{minutes} min"),
        _ => format!("{} h {} min", minutes / 60, minutes % 60),
    }
}

/// A log line that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DueLine {
    Wait,
    Progress,
}

/// Times of the last log lines.
#[derive(Debug, Default)]
struct Schedule {
    /// Elapsed time at the last progress line.
    progress: Duration,
    /// Length of the current wait at the last line about it.
    wait: Option<Duration>,
}

impl Schedule {
    /// Returns the lines that are due after `elapsed`. `waited` is the time for which the policy has been
    /// waited for.
    fn due(&mut self, elapsed: Duration, waited: Option<Duration>) -> impl Iterator<Item = DueLine> {
        // A wait that is shorter than before is a new wait.
        self.wait = self.wait.filter(|told| waited.is_some_and(|waited| waited >= *told));
        let next_wait = match self.wait {
            None => WAIT_FIRST,
            Some(told) if told < LINE_EVERY => told + WAIT_EVERY,
            Some(told) => told + LINE_EVERY,
        };
        let wait = waited.filter(|waited| *waited >= next_wait);
        self.wait = wait.or(self.wait);
        let progress = elapsed >= self.progress + LINE_EVERY;
        if progress {
            self.progress = elapsed;
        }
        let wait = wait.map(|_| DueLine::Wait);
        wait.into_iter().chain(progress.then_some(DueLine::Progress))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_line_a_minute_says_what_is_left() {
        let mut schedule = Schedule::default();
        let due: Vec<u32> =
            (1..=300).filter(|s| schedule.due(SECOND * *s, None).next() == Some(DueLine::Progress)).collect();
        assert_eq!(due, [60, 120, 180, 240, 300]);

        let tally = Tally {
            planned: 100,
            kept: 30,
            played: 6,
            left_out: 1,
            excluded: 2,
            failed: 4,
            ..Tally::default()
        };
        assert_eq!(
            tally.line(SECOND * 600),
            "37 of 100 episodes done (4 failed, 2 not counted because the policy or the simulator failed, 1 left out), 63 left, \
             about 1 h 45 min at this pace"
        );
        let begun = Tally { planned: 3, ..Tally::default() };
        assert_eq!(begun.line(SECOND * 60), "0 of 3 episodes done, 3 left, no pace known yet");
        assert_eq!(Tally { played: 2, ..begun }.bar_text(SECOND * 60), "about 30 s left");
    }

    #[test]
    fn a_wait_is_said_soon_and_then_every_ten_seconds() {
        let mut schedule = Schedule::default();
        let mut said = |elapsed: u32, waited: Option<u32>| {
            schedule.due(SECOND * elapsed, waited.map(|s| SECOND * s)).any(|line| line == DueLine::Wait)
        };
        let first: Vec<u32> = (1..=200).filter(|s| said(*s, Some(*s))).collect();
        assert_eq!(first, [2, 12, 22, 32, 42, 52, 62, 122, 182]);
        assert!(!said(201, None));
        // A shorter wait counts as a new wait.
        assert_eq!((202..=220).filter(|s| said(*s, Some(*s - 201))).collect::<Vec<_>>(), [203, 213]);
    }

    #[test]
    fn times_are_in_words() {
        for (seconds, words) in
            [(0, "0 s"), (89, "89 s"), (90, "2 min"), (5399, "90 min"), (6300, "1 h 45 min")]
        {
            assert_eq!(in_words(SECOND * seconds), words);
        }
    }
}
