//! Diagnosis of a missed phase: its conditions, and how near a recorded episode came to them.

use tandem_sim::CONTROL_HZ;

use crate::conditions::ConditionPart;
use crate::recording::{Recording, RecordingError};
use crate::scoring::{Facts, Phase, Predicate, StepScore};
use crate::tasks::{PhaseCondition, PhaseSetting};

/// The first phase that an episode did not reach, over the steps in which it was next.
#[derive(Debug)]
pub struct PhaseTrace {
    pub number: String,
    pub id: String,
    pub from_s: f64,
    pub to_s: f64,
    /// Greatest nearness, from 0 to 1, and its time.
    pub nearest: Moment<f32>,
    /// Description of when the phase counts as reached.
    pub description: String,
    pub conditions: Vec<ConditionTrace>,
}

/// The best value of a quantity, and its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment<T> {
    pub best: T,
    pub time_s: f64,
}

/// One condition of the phase.
#[derive(Debug)]
pub struct ConditionTrace {
    pub setting: PhaseSetting,
    /// Duration for which the condition has to hold without interruption.
    pub for_s: f64,
    /// Record of the times at which all its parts held together.
    pub held: Held,
    pub parts: Vec<PartTrace>,
    /// Largest number of parts that held at once.
    pub most_at_once: Moment<usize>,
}

/// A part of a condition; all parts have to hold.
#[derive(Debug)]
pub struct PartTrace {
    /// Line and column in the task's file.
    pub place: [usize; 2],
    /// The text in that file, with numbers of five digits at most.
    pub text: String,
    pub held: Held,
    /// Closest value of a numeric condition that never held; `None` for others.
    pub nearest: Option<Moment<Closest>>,
}

/// Measure of a condition's distance from holding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Closest {
    /// Both sides of a comparison.
    Sides([f64; 2]),
    /// A share from 0 to 1, for example of a hand that approaches an object to hold it.
    Share(f32),
}

/// Record of the times at which a condition held.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Held {
    /// Number of steps in which the condition held; `of` is the number of all steps.
    pub steps: u32,
    pub of: u32,
    /// Time at which it first held.
    pub first_s: Option<f64>,
    /// Largest number of steps without a break.
    pub longest: u32,
    present: u32,
}

impl Held {
    fn take(&mut self, holds: bool, time_s: f64) {
        self.of += 1;
        self.present = if holds { self.present + 1 } else { 0 };
        self.longest = self.longest.max(self.present);
        if holds {
            self.steps += 1;
            self.first_s.get_or_insert(time_s);
        }
    }

    /// Returns the total duration in seconds.
    pub fn total_s(&self) -> f64 {
        f64::from(self.steps) / CONTROL_HZ
    }

    /// Returns the longest duration without a break in seconds, from the first of its steps to the last, as
    /// durations are counted.
    pub fn longest_s(&self) -> f64 {
        f64::from(self.longest.saturating_sub(1)) / CONTROL_HZ
    }
}

impl PhaseTrace {
    /// Traces the phase that would have been next when the recording ends; `None` if the last one was
    /// reached.
    ///
    /// # Errors
    ///
    /// If the recording cannot be read.
    pub fn of(recording: &Recording) -> Result<Option<PhaseTrace>, RecordingError> {
        let task = &recording.spec.task;
        let reached = recording.phases()?;
        let Some(phase) = task.phases.get(reached.len()) else { return Ok(None) };
        let since_s = reached.last().map_or(f64::NEG_INFINITY, |last| last.time_s);
        let asked = &task.conditions[reached.len()];
        let mut trace = PhaseTrace {
            number: Phase::number(reached.len()),
            id: phase.id.clone(),
            from_s: f64::INFINITY,
            to_s: 0.0,
            nearest: Moment { best: 0.0, time_s: 0.0 },
            description: phase.description.clone(),
            conditions: asked.iter().map(ConditionTrace::begin).collect(),
        };
        recording.score_with(|StepScore { facts, .. }| {
            if facts.time_s >= since_s {
                trace.look(phase, asked, facts);
            }
        })?;
        Ok(Some(trace))
    }

    fn look(&mut self, phase: &Phase, asked: &[PhaseCondition], facts: &Facts) {
        let time_s = facts.time_s;
        (self.from_s, self.to_s) = (self.from_s.min(time_s), time_s);
        let best = (phase.nearness)(facts);
        if best > self.nearest.best {
            self.nearest = Moment { best, time_s };
        }
        self.conditions.iter_mut().zip(asked).for_each(|(trace, asked)| trace.look(asked, facts));
    }
}

impl ConditionTrace {
    fn begin(asked: &PhaseCondition) -> ConditionTrace {
        let part = |(place, part): &([usize; 2], ConditionPart)| PartTrace {
            place: *place,
            text: part.text.clone(),
            held: Held::default(),
            nearest: None,
        };
        ConditionTrace {
            setting: asked.setting,
            for_s: asked.for_s,
            held: Held::default(),
            parts: asked.parts.iter().map(part).collect(),
            most_at_once: Moment { best: 0, time_s: 0.0 },
        }
    }

    fn look(&mut self, asked: &PhaseCondition, facts: &Facts) {
        let time_s = facts.time_s;
        self.held.take(asked.truth.holds(facts), time_s);
        let mut best = 0;
        for (trace, (_, part)) in self.parts.iter_mut().zip(&asked.parts) {
            let holds = part.truth.holds(facts);
            best += usize::from(holds);
            trace.held.take(holds, time_s);
            let near = part.truth.sides(facts).map(Closest::Sides);
            let near =
                near.or_else(|| part.truth.grows().then(|| Closest::Share(part.truth.nearness(facts))));
            let farther = |best: &Moment<Closest>, near: &Closest| best.best.missing() <= near.missing();
            if let Some(near) = near
                && !trace.nearest.is_some_and(|best| farther(&best, &near))
            {
                trace.nearest = Some(Moment { best: near, time_s });
            }
        }
        if best > self.most_at_once.best {
            self.most_at_once = Moment { best, time_s };
        }
    }
}

impl Closest {
    fn missing(self) -> f64 {
        match self {
            Closest::Sides([left, right]) => (left - right).abs(),
            Closest::Share(share) => 1.0 - f64::from(share),
        }
    }
}
