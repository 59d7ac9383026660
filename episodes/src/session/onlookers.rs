//! Events of a session for viewers. They do not affect the session: steps and calls are passed on after
//! they have been made.

use std::collections::VecDeque;
use std::sync::Arc;

use tandem_tools_spec::{Budget, ExtraInformation, Observe, PhaseReached};

use super::Session;
use crate::EpisodeError;
use crate::live::{LiveEntry, LiveEvent, LiveScene, LiveStep, LiveView, Onlookers, STEPS_PER_EXPLANATION};
use crate::output::OutputError;
use crate::recording::{NoteMessage, ToolCallRecord};

/// Maximum number of calls and notes stored for later viewers.
const KEPT_ENTRIES: usize = 50;

/// The receiver of events, if there is one, and the entries for later viewers.
#[derive(Default)]
pub struct Spectators {
    onlookers: Option<Box<dyn Onlookers>>,
    /// Latest entries, the oldest first.
    entries: VecDeque<Arc<LiveEntry>>,
    /// Number of entries, and number of counted calls among them.
    told_entries: u32,
    counted_calls: u32,
    scene: Option<Arc<LiveScene>>,
    /// Control step sent last.
    told_step: Option<u64>,
}

impl Spectators {
    fn tell(&self, event: impl FnOnce() -> LiveEvent) {
        if let Some(onlookers) = self.onlookers.as_deref().filter(|onlookers| onlookers.any()) {
            onlookers.tell(event());
        }
    }
}

impl Session {
    /// Sends events to `onlookers` from now on.
    pub fn set_onlookers(&mut self, onlookers: Box<dyn Onlookers>) {
        self.spectators.onlookers = Some(onlookers);
    }

    /// Returns the current state of the episode for a new viewer. This is no call.
    pub fn live_view(&mut self) -> LiveView {
        let scene = match &self.spectators.scene {
            Some(scene) => scene.clone(),
            None => {
                let made = Arc::new(LiveScene::of(self.spec(), &self.world, &self.motions));
                self.spectators.scene.insert(made).clone()
            }
        };
        LiveView {
            scene,
            now: Arc::new(self.live_step(self.budget())),
            entries: self.spectators.entries.iter().cloned().collect(),
            phases: self.reached(),
            next_phase: self.next_phase(None),
            result: self.result.clone(),
        }
    }

    /// Returns the state like [`Session::live_view`], for the person driving `robot`, with a view of the
    /// whole scene. It counts as an observation, so that recordings and results include it; its image is
    /// not used.
    pub fn drivers_view(&mut self, robot: &str) -> Result<LiveView, EpisodeError> {
        let look = Observe { robots: Some(vec![robot.into()]), ..Observe::of_all() };
        self.observe(&look, &[ExtraInformation::ThirdPerson])?;
        Ok(self.live_view())
    }

    /// Sends the current step, if it is wanted.
    pub(super) fn show_step(&mut self, budget: Budget) {
        let step = self.present.control_step;
        let onlookers = self.spectators.onlookers.as_deref();
        if onlookers.is_some_and(|onlookers| onlookers.any() && onlookers.wants_step(step)) {
            self.tell_step(budget);
        }
        if step.is_multiple_of(STEPS_PER_EXPLANATION) {
            self.show_next_phase();
        }
    }

    fn show_next_phase(&self) {
        let is_watched = self.spectators.onlookers.as_deref().is_some_and(|onlookers| onlookers.any());
        if let (true, Some(next)) = (is_watched, self.next_phase(None)) {
            self.spectators.tell(|| LiveEvent::NextPhase(Arc::new(next)));
        }
    }

    fn tell_step(&mut self, budget: Budget) {
        self.spectators.tell(|| LiveEvent::Step(Arc::new(self.live_step(budget))));
        self.spectators.told_step = Some(self.present.control_step);
    }

    pub(super) fn show_phase(&self, phase: &PhaseReached) {
        self.spectators.tell(|| LiveEvent::Phase(phase.clone()));
    }

    /// Sends the last step and the result of the episode.
    pub(super) fn show_end(&mut self) {
        self.tell_step(self.budget());
        if let Some(result) = &self.result {
            self.spectators.tell(|| LiveEvent::Ended(Arc::new(result.clone())));
        }
    }

    /// Returns true if calls are shown, or stored for viewers.
    pub(super) fn shows_calls(&self) -> bool {
        self.spectators.onlookers.is_some()
    }

    /// Sends a finished call, and the step that it has reached, since the next step may take long.
    pub(super) fn show_call(&mut self, record: &Result<ToolCallRecord, OutputError>) {
        if self.spectators.told_step != Some(self.present.control_step) {
            self.tell_step(self.budget());
            self.show_next_phase();
        }
        let Ok(record) = record else { return };
        self.spectators.counted_calls += u32::from(record.message.counted);
        let number = record.message.counted.then_some(self.spectators.counted_calls);
        self.show_entry(|entry| LiveEntry::of_call(entry, number, record));
    }

    pub(super) fn show_note(&mut self, note: &NoteMessage) {
        let time_s = self.present.time_s;
        self.show_entry(|entry| LiveEntry::of_note(entry, time_s, note));
    }

    fn show_entry(&mut self, made: impl FnOnce(u32) -> LiveEntry) {
        if !self.shows_calls() {
            return;
        }
        self.spectators.told_entries += 1;
        let entry = Arc::new(made(self.spectators.told_entries));
        if self.spectators.entries.len() == KEPT_ENTRIES {
            self.spectators.entries.pop_front();
        }
        self.spectators.entries.push_back(Arc::new(entry.without_pictures()));
        self.spectators.tell(|| LiveEvent::Entry(entry));
    }

    fn live_step(&self, budget: Budget) -> LiveStep {
        let motions = self.motions.iter().map(|motion| motion.state().clone()).collect();
        LiveStep::new(self.present.clone(), motions, Some(budget))
    }
}
