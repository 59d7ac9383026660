//! The history of observations that a request contains.

use std::collections::VecDeque;

use tandem_episodes::players::{LocalEpisode, PlayerError};
use tandem_tools_spec::ExtraInformation;

use super::PolicyObservation;
use crate::{columns::EpisodeMoment, map::PolicyMap};

/// Observations of an episode that later requests may still need.
pub struct ObservationHistory {
    /// Number of observations in a request. `stride` is the number of executed rows between two of them.
    length: usize,
    stride: usize,
    /// Extra information in the observations, which the benchmark withholds from its own policies.
    shown: Vec<ExtraInformation>,
    episode: u32,
    /// Latest observation. `present_rows` is the number of rows that were executed before it.
    present: PolicyObservation,
    present_rows: usize,
    /// Earlier observations with their numbers of executed rows, oldest first.
    past: VecDeque<(usize, PolicyObservation)>,
}

impl ObservationHistory {
    /// Makes the first observation of the episode with this number.
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

    /// Returns the latest observation.
    pub fn present(&self) -> &PolicyObservation {
        &self.present
    }

    /// Observes the episode after `rows` executed rows.
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
        // The latest outdated observation is kept for times without an observation.
        let oldest = rows.saturating_sub((self.length - 1) * self.stride);
        while self.length == 1 && !self.past.is_empty()
            || self.past.get(1).is_some_and(|(at, _)| *at <= oldest)
        {
            self.past.pop_front();
        }
    }

    /// Returns the numbers of executed rows between `from` and `to` at which observations are needed, so that
    /// a request after `to` rows has its history.
    pub fn looks_between(&self, from: usize, to: usize) -> Vec<usize> {
        let past = (1..self.length).rev().filter_map(|back| to.checked_sub(back * self.stride));
        past.filter(|rows| *rows > from).collect()
    }

    /// Returns the observations for a request, oldest first. The first observation also represents times
    /// before it.
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

    /// Returns an observation whose first value is the number of rows executed before.
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
        // The chunk is shorter than the history, and its ends are at other rows, so the last earlier
        // observation is used.
        assert!(three.looks_between(10, 13).is_empty());
        assert_eq!(after(&mut three, &[13]), [2.0, 6.0, 13.0]);
        let mut one = history(1, 1);
        assert_eq!(after(&mut one, &[50]), [50.0]);
        assert!(one.looks_between(50, 100).is_empty() && one.past.is_empty());
    }
}
