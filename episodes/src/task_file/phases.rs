//! The phases of a task's file: which of the four ways to be reached each has, and what its expressions mean.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use toml::Spanned;

use super::reading::{Reading, lasting, place_in_file};
use super::table::{MilestoneTable, PhaseTable};
use crate::conditions::{self, Mistake, Names, Truth};
use crate::scoring::{Condition, Done, Facts, Milestone, Nearness, Phase};

const EXAMPLE: &str =
    "give done = '...', or first = '...' and then = '...', or lasting = '...' and for_s, or milestones";
/// Nothing is waited for any longer.
const LONGEST_S: f64 = 3600.0;

/// The phases, and before them the terms, each of which may name those above it.
pub(super) fn phases(
    reading: &mut Reading,
    terms: BTreeMap<Spanned<String>, Spanned<String>>,
    tables: Vec<PhaseTable>,
    names: &mut Names,
) -> Vec<Phase> {
    let mut terms: Vec<_> = terms.into_iter().collect();
    terms.sort_by_key(|(name, _)| name.span().start);
    for (name, text) in terms {
        reading.id(&name, "a term");
        match reading.meant(&text, |text| conditions::term(text, names)) {
            Some(meaning) => drop(names.terms.insert(name.into_inner(), meaning)),
            None => drop(names.mistaken_terms.insert(name.into_inner())),
        }
    }
    let mut found: Vec<Phase> = Vec::new();
    for table in tables {
        reading.id(&table.id, "a phase");
        reading.words(&table.description);
        if found.iter().any(|phase| phase.id == table.id.as_ref()) {
            reading.wrong(table.id.span(), "there is a phase of this id already");
        }
        found.extend(reading.phase(&table, names));
    }
    found
}

impl Reading<'_> {
    fn phase(&mut self, table: &PhaseTable, names: &Names) -> Option<Phase> {
        let (done, parts) = self.done(table, names)?;
        let done = match &table.spoiled {
            None => done,
            Some(text) => {
                Done::Unless { spoiled: condition(&self.condition(text, names)?), done: leaked(done) }
            }
        };
        let near = match &table.near {
            None => None,
            Some(text) => Some(self.meant(text, |text| conditions::number(text, names))?),
        };
        let nearness: Nearness = match near {
            Some(number) => leaked(move |facts: &Facts| {
                let value = number.value(facts);
                if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) as f32 }
            }),
            None => leaked(move |facts: &Facts| {
                let sum: f32 = parts.iter().map(|part| part.nearness(facts)).sum();
                sum / parts.len() as f32
            }),
        };
        Some(Phase {
            id: lasting(table.id.as_ref()),
            description: lasting(table.description.as_ref()),
            collaborative: table.collaborative,
            done,
            nearness,
        })
    }

    /// How a phase is reached, and what has to hold for it at the end.
    fn done(&mut self, table: &PhaseTable, names: &Names) -> Option<(Done, Vec<Arc<Truth>>)> {
        let PhaseTable { done, first, then, broken, lasting, for_s, at_end, milestones, .. } = table;
        let given =
            (done.is_some(), first.is_some() || then.is_some(), lasting.is_some(), milestones.is_some());
        let stray = |given: &Option<Spanned<String>>| given.as_ref().map(Spanned::span);
        let stray = match given {
            (true, false, false, false) => {
                stray(broken).or(stray(at_end)).or(for_s.as_ref().map(Spanned::span))
            }
            (false, true, false, false) => stray(at_end).or(for_s.as_ref().map(Spanned::span)),
            (false, false, true, false) => stray(broken),
            (false, false, false, true) => {
                stray(broken).or(stray(at_end)).or(for_s.as_ref().map(Spanned::span))
            }
            _ => Some(table.id.span()),
        };
        if let Some(at) = stray {
            self.wrong(at, format!("a phase is reached in one way; {EXAMPLE}"));
            return None;
        }
        match (done, (first, then), (lasting, for_s), milestones) {
            (Some(done), ..) => {
                let truth = self.condition(done, names)?;
                Some((Done::When(condition(&truth)), vec![truth]))
            }
            (_, (Some(first), Some(then)), ..) => {
                let (first, then) = (self.condition(first, names), self.condition(then, names));
                let broken = self.condition_or(broken, names, false);
                let (first, then, broken) = (first?, then?, broken?);
                let done = Done::Sequence {
                    first: condition(&first),
                    then: condition(&then),
                    broken: condition(&broken),
                };
                Some((done, vec![first, then]))
            }
            (_, _, (Some(lasting), Some(for_s)), _) => {
                let truth = self.condition(lasting, names);
                let at_end = self.condition_or(at_end, names, true);
                let for_s = self.duration_s(for_s);
                let (truth, at_end) = (truth?, at_end?);
                let done = Done::Lasting { condition: condition(&truth), for_s, at_end: condition(&at_end) };
                Some((done, vec![truth]))
            }
            (_, _, _, Some(milestones)) => self.milestones(milestones, names),
            _ => {
                self.wrong(table.id.span(), format!("a part of this phase is missing; {EXAMPLE}"));
                None
            }
        }
    }

    fn milestones(
        &mut self,
        tables: &Spanned<Vec<MilestoneTable>>,
        names: &Names,
    ) -> Option<(Done, Vec<Arc<Truth>>)> {
        let mut parts = Vec::new();
        let mut found = Vec::new();
        for table in tables.as_ref() {
            let for_s = table.for_s.as_ref().map_or(0.0, |for_s| self.duration_s(for_s));
            let truth = self.condition(&table.condition, names)?;
            found.push(Milestone { condition: condition(&truth), for_s });
            parts.push(truth);
        }
        if found.is_empty() {
            let what =
                "no milestones; give some, as [{ condition = '...' }, { condition = '...', for_s = 0.5 }]";
            self.wrong(tables.span(), what);
            return None;
        }
        Some((Done::Milestones(Vec::leak(found)), parts))
    }

    fn duration_s(&mut self, for_s: &Spanned<f64>) -> f64 {
        if !(0.0..=LONGEST_S).contains(for_s.as_ref()) {
            self.wrong(for_s.span(), format!("this may be 0 to {LONGEST_S} seconds, as 0.5"));
        }
        *for_s.as_ref()
    }

    /// A condition on which something depends: one that comes out the same whatever happens is a mistake.
    fn condition(&mut self, text: &Spanned<String>, names: &Names) -> Option<Arc<Truth>> {
        let truth = self.meant(text, |text| conditions::condition(text, names))?;
        let what = match truth.always() {
            None => return Some(truth),
            Some(true) => {
                "this holds whatever happens, so it asks for nothing; leave it out, or compare with what facts can be"
            }
            Some(false) => {
                "this can never hold, whatever happens; compare with what facts can be (an angle from upright is 0 to 180 degrees)"
            }
        };
        self.wrong(text.span(), what);
        None
    }

    /// The condition, or what is always so where none is given.
    fn condition_or(
        &mut self,
        text: &Option<Spanned<String>>,
        names: &Names,
        otherwise: bool,
    ) -> Option<Arc<Truth>> {
        match text {
            Some(text) => self.condition(text, names),
            None => Some(Truth::Always(otherwise).into()),
        }
    }

    /// What an expression means; a mistake in it is told by its place in the file.
    fn meant<T>(&mut self, text: &Spanned<String>, read: impl Fn(&str) -> Result<T, Mistake>) -> Option<T> {
        match read(text.as_ref()) {
            Ok(meaning) => Some(meaning),
            Err(mistake) if mistake.follows() => None,
            Err(Mistake { at, text: what }) => {
                let start = place_in_file(&self.source.text, text);
                self.wrong(at_in_file(start, at), what);
                None
            }
        }
    }
}

fn at_in_file(start: usize, at: Range<usize>) -> Range<usize> {
    start + at.start..start + at.end
}

/// As phases have it, for as long as the program runs.
fn condition(truth: &Arc<Truth>) -> Condition {
    let truth = truth.clone();
    leaked(move |facts: &Facts| truth.holds(facts))
}

fn leaked<T>(function: T) -> &'static T {
    Box::leak(Box::new(function))
}
