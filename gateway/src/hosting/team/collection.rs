//! A collection of demonstrations: people play one episode after another on a server used only for this.
//!
//! Each person keeps the same operator's token, and marks every episode as good or bad.

use std::{
    fmt,
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
};

use serde::Serialize;
use tandem_tools_spec::OperatorToken;

use crate::token::{Token, TokenError};

/// A series of episodes that the same people play.
pub struct Collection {
    seats: Vec<(Token, OperatorToken)>,
    progress: Mutex<CollectionProgress>,
    /// Notified when a person has marked the episode that was played last.
    marked: Condvar,
}

/// Progress of a collection, for the operators' pages.
#[derive(Debug, Clone, Serialize)]
pub struct CollectionProgress {
    /// Current activity of the people.
    pub stage: CollectionStage,
    /// Episode that is being played, or otherwise the episode that was played last.
    pub episode: Option<CollectedEpisode>,
    /// Number of planned episodes.
    pub planned: usize,
    /// Number of good episodes since this server started.
    pub good: usize,
    /// Number of episodes since this server started that a person marked bad.
    pub bad: usize,
    /// Marks of `episode` by seat: true for good, false for bad, `None` before the person has marked it.
    pub marks: Vec<Option<bool>>,
}

/// Current activity of the people in a collection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CollectionStage {
    /// They wait for the next episode.
    Preparing,
    /// They play.
    Playing,
    /// They mark the episode as good or bad.
    Marking,
    /// The collection is complete.
    Over,
}

/// An episode of a collection.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CollectedEpisode {
    /// Id of the episode on the server.
    pub episode_id: String,
    /// Id of the task.
    pub task: String,
    /// Seed of the episode.
    pub seed: u32,
    /// Number among the planned episodes, counted from 1.
    pub number: usize,
}

impl fmt::Debug for Collection {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.write_str("Collection(..)")
    }
}

impl Collection {
    /// Creates a collection of `planned` episodes with a seat for each of `robots`.
    pub fn new(robots: &[&str], planned: usize) -> Result<Collection, TokenError> {
        let seat = |robot: &&str| {
            let (token, text) = Token::random()?;
            Ok((token, OperatorToken { robot: (*robot).into(), token: text }))
        };
        let progress = CollectionProgress {
            stage: CollectionStage::Preparing,
            episode: None,
            planned,
            good: 0,
            bad: 0,
            marks: vec![None; robots.len()],
        };
        let seats = robots.iter().map(seat).collect::<Result<_, TokenError>>()?;
        Ok(Collection { seats, progress: Mutex::new(progress), marked: Condvar::new() })
    }

    /// Returns the operators' tokens.
    pub fn operators(&self) -> impl Iterator<Item = &OperatorToken> {
        self.seats.iter().map(|(_, operator)| operator)
    }

    /// Returns the token of the seat of `robot`.
    pub fn seat(&self, robot: &str) -> Option<(Token, String)> {
        let (token, operator) = self.seats.iter().find(|(_, operator)| operator.robot == robot)?;
        Some((token.clone(), operator.token.clone()))
    }

    /// Returns the robot whose person has the token `text`. Compares every token, so that the time taken does
    /// not reveal the match.
    pub fn robot_of(&self, text: &str) -> Option<&str> {
        let robots = self.seats.iter().map(|(token, seat)| (token.matches(text), seat.robot.as_str()));
        robots.fold(None, |found, (matches, robot)| if matches { Some(robot) } else { found })
    }

    /// Returns the current progress.
    pub fn progress(&self) -> CollectionProgress {
        self.lock().clone()
    }

    /// Makes `episode` the episode that is being played, and clears the marks.
    pub fn begin(&self, episode: CollectedEpisode) {
        let mut progress = self.lock();
        progress.stage = CollectionStage::Playing;
        progress.episode = Some(episode);
        progress.marks.fill(None);
    }

    /// Waits until everybody has marked the ended episode, and returns the robots whose people marked it
    /// bad.
    pub fn wait_for_marks(&self) -> Vec<&str> {
        let mut progress = self.lock();
        progress.stage = CollectionStage::Marking;
        let all = |progress: &mut CollectionProgress| progress.marks.contains(&None);
        let mut progress = self.marked.wait_while(progress, all).unwrap_or_else(PoisonError::into_inner);
        let marks = self.operators().zip(&progress.marks);
        let bad: Vec<&str> =
            marks.filter(|(_, mark)| **mark == Some(false)).map(|(seat, _)| seat.robot.as_str()).collect();
        progress.stage = CollectionStage::Preparing;
        match bad.is_empty() {
            true => progress.good += 1,
            false => progress.bad += 1,
        }
        bad
    }

    /// Marks the episode for the person of `robot`. Returns false and keeps no mark outside the marking
    /// stage.
    ///
    /// A mark can be changed until everybody has marked.
    pub fn mark(&self, robot: &str, good: bool) -> bool {
        let seat = self.operators().position(|operator| operator.robot == robot);
        let mut progress = self.lock();
        let counts = progress.stage == CollectionStage::Marking;
        if let (true, Some(seat)) = (counts, seat) {
            progress.marks[seat] = Some(good);
            self.marked.notify_all();
        }
        counts && seat.is_some()
    }

    /// Ends the collection.
    pub fn end(&self) {
        self.lock().stage = CollectionStage::Over;
    }

    fn lock(&self) -> MutexGuard<'_, CollectionProgress> {
        // Nothing panics while it holds the lock.
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_episode_is_good_when_everybody_says_so() {
        let collection = Collection::new(&["A", "B"], 2).unwrap();
        assert!(!collection.mark("A", true), "nothing has been played");
        let episode =
            |seed| CollectedEpisode { episode_id: format!("x-{seed}"), task: "x".into(), seed, number: 1 };
        let played = |seed, marks: [bool; 2]| {
            collection.begin(episode(seed));
            std::thread::scope(|scope| {
                let waiting = scope.spawn(|| collection.wait_for_marks());
                for (robot, good) in ["A", "B"].into_iter().zip(marks) {
                    while !collection.mark(robot, good) {
                        std::thread::yield_now();
                    }
                    assert!(robot == "B" || !waiting.is_finished(), "one of two is not everybody");
                }
                waiting.join().unwrap()
            })
        };
        assert_eq!(played(0, [true, true]), Vec::<&str>::new());
        assert_eq!(played(1, [true, false]), ["B"]);
        let progress = collection.progress();
        assert_eq!((progress.good, progress.bad, progress.stage), (1, 1, CollectionStage::Preparing));
    }

    #[test]
    fn a_seat_is_known_by_its_token_and_tells_it_to_nobody() {
        let collection = Collection::new(&["A", "B"], 1).unwrap();
        let tokens: Vec<String> = collection.operators().map(|seat| seat.token.clone()).collect();
        assert_eq!(
            tokens.iter().map(|text| collection.robot_of(text)).collect::<Vec<_>>(),
            [Some("A"), Some("B")]
        );
        assert_eq!(collection.robot_of("0123456789abcdef0123456789abcdef01234567"), None);
        let told = serde_json::to_string(&collection.progress()).unwrap();
        assert!(tokens.iter().all(|token| !told.contains(token)), "{told}");
    }
}
