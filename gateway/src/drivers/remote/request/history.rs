//! What was observed so far, as far as a policy is shown it.

use std::collections::VecDeque;

use tandem_episodes::players::{LocalEpisode, PlayerError};
use tandem_tools_spec::ExtraInformation;

use super::PolicyObservation;
use crate::drivers::remote::{columns::EpisodeMoment, map::PolicyMap};

/// The observations of an episode that a policy may still be shown.
pub struct ObservationHistory {
    /// How many a policy is shown, and how many rows lie between two of them.
    length: usize,
    stride: usize,
    /// What of an observation the benchmark's own policies are not shown.
    shown: Vec<ExtraInformation>,
    episode: u32,
    /// The latest, and the number of rows that were executed before it.
    present: PolicyObservation,
    present_rows: usize,
    /// Earlier ones with theirs, the oldest first.
    past: VecDeque<(usize, PolicyObservation)>,
}

impl ObservationHistory {
    /// The first look at the episode of this number.
    pub fn begin(
        map: &PolicyMap,
        episode: &mut dyn LocalEpisode,
        number: u32,
    ) -> Result<ObservationHistory, PlayerError> {
        let shown = map.shown();
        let (length, stride) = map.history.map_or((1, 1), |history| (history.length, history.stride));
        let first = EpisodeMoment { episode: number, done_steps: 0.0, is_first: true };
        let present = PolicyObservation::take(episode, &shown, first)?;
        Ok(ObservationHistory {
            length,
            stride,
            shown,
            episode: number,
            present,
            present_rows: 0,
            past: VecDeque::new(),
        })
    }

    /// What robots see and feel now.
    pub fn present(&self) -> &PolicyObservation {
        &self.present
    }

    /// Looks at the episode, of which `rows` rows have been executed now.
    pub fn look(&mut self, episode: &mut dyn LocalEpisode, rows: usize) -> Result<(), PlayerError> {
        let moment = EpisodeMoment { episode: self.episode, done_steps: 0.0, is_first: false };
        let observation = PolicyObservation::take(episode, &self.shown, moment)?;
        self.remember(rows, observation);
        Ok(())
    }

    fn remember(&mut self, rows: usize, observation: PolicyObservation) {
        let before = std::mem::replace(&mut self.present, observation);
        self.past.push_back((self.present_rows, before));
        self.present_rows = rows;
        // Of those that are too old, the youngest stands for moments at which nobody looked.
        let oldest = rows.saturating_sub((self.length - 1) * self.stride);
        while self.length == 1 && !self.past.is_empty()
            || self.past.get(1).is_some_and(|(at, _)| *at <= oldest)
        {
            self.past.pop_front();
        }
    }

    /// The numbers of rows, above `from` and below `to`, after which there has to be a look so that a request after `to` rows
    /// has its history.
    pub fn looks_between(&self, from: usize, to: usize) -> Vec<usize> {
        let past = (1..self.length).rev().filter_map(|back| to.checked_sub(back * self.stride));
        past.filter(|rows| *rows > from).collect()
    }

    /// What a policy is shown now, the oldest first. Before the first look, it was as then.
    pub fn shown(&self) -> Vec<&PolicyObservation> {
        let at = |back: usize| {
            let wanted = self.present_rows.saturating_sub(back * self.stride);
            let before = self.past.iter().rev().find(|(rows, _)| *rows <= wanted);
            before.or(self.past.front()).map_or(&self.present, |(_, observation)| observation)
        };
        (1..self.length).rev().map(at).chain([&self.present]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An observation whose first number is how many rows were executed before.
    fn observation(rows: usize) -> PolicyObservation {
        let mut observation = PolicyObservation::blank(1);
        observation.robots[0].state_values[0] = rows as f64;
        observation
    }

    fn history(length: usize, stride: usize) -> ObservationHistory {
        ObservationHistory {
            length,
            stride,
            shown: Vec::new(),
            episode: 1,
            present: observation(0),
            present_rows: 0,
            past: VecDeque::new(),
        }
    }

    fn after(history: &mut ObservationHistory, looks: &[usize]) -> Vec<f64> {
        looks.iter().for_each(|rows| history.remember(*rows, observation(*rows)));
        history.shown().iter().map(|observation| observation.robots[0].state_values[0]).collect()
    }

    #[test]
    fn the_past_is_shown_at_its_stride() {
        let mut three = history(3, 4);
        assert_eq!(after(&mut three, &[]), [0.0, 0.0, 0.0], "before the first look, it was as then");
        assert_eq!(three.looks_between(0, 10), [2, 6]);
        assert_eq!(after(&mut three, &[2, 6, 10]), [2.0, 6.0, 10.0]);
        assert_eq!(three.past.len(), 2, "older ones are forgotten");
        // A chunk that is shorter than the history, and whose ends do not fall together: the last look before.
        assert!(three.looks_between(10, 13).is_empty());
        assert_eq!(after(&mut three, &[13]), [2.0, 6.0, 13.0]);
        let mut one = history(1, 1);
        assert_eq!(after(&mut one, &[50]), [50.0]);
        assert!(one.looks_between(50, 100).is_empty() && one.past.is_empty());
    }
}
