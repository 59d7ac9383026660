//! The phases of a task file: selects which of the four kinds each phase is, and reads its expressions.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use toml::Spanned;

use super::reading::{Reading, place_in_file};
use super::table::{MilestoneTable, PhaseTable};
use crate::conditions::{self, ConditionPart, Meaning, Mistake, Names, Truth};
use crate::scoring::{Condition, Done, Facts, Milestone, Nearness, Phase};
use crate::tasks::{PhaseCondition, PhaseSetting};

const EXAMPLE: &str =
    "give done = '...', or first = '...' and then = '...', or lasting = '...' and for_s, or milestones";
/// Maximum duration that a phase may require.
const LONGEST_S: f64 = 3600.0;

/// Returns the phases with their conditions. Terms are read first. A term may refer to earlier terms.
pub(super) fn phases(
    reading: &mut Reading,
    terms: BTreeMap<Spanned<String>, Spanned<String>>,
    tables: Vec<PhaseTable>,
    names: &mut Names,
) -> Vec<(Phase, Vec<PhaseCondition>)> {
    let mut terms: Vec<_> = terms.into_iter().collect();
    terms.sort_by_key(|(name, _)| name.span().start);
    for (name, text) in terms {
        reading.id(&name, "a term");
        match reading.meant(&text, |text| conditions::term(text, names)) {
            Some(meaning) => {
                if let Meaning::Truth(_) = &meaning
                    && let Some(parts) = reading.parts(&text, names)
                {
                    names.parts_of_terms.insert(name.as_ref().clone(), parts);
                }
                names.terms.insert(name.into_inner(), meaning);
            }
            None => drop(names.mistaken_terms.insert(name.into_inner())),
        }
    }
    let mut found: Vec<(Phase, Vec<PhaseCondition>)> = Vec::new();
    for table in tables {
        reading.id(&table.id, "a phase");
        reading.words(&table.description);
        if found.iter().any(|(phase, _)| phase.id == *table.id.as_ref()) {
            reading.wrong(table.id.span(), "there is a phase of this id already");
        }
        found.extend(reading.phase(&table, names));
    }
    found
}

impl Reading<'_> {
    fn phase(&mut self, table: &PhaseTable, names: &Names) -> Option<(Phase, Vec<PhaseCondition>)> {
        let (done, mut conditions) = self.done(table, names)?;
        let near = match &table.near {
            None => None,
            Some(text) => Some(self.meant(text, |text| conditions::number(text, names))?),
        };
        let nearness: Nearness = match near {
            Some(number) => Arc::new(move |facts: &Facts| {
                let value = number.value(facts);
                if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) as f32 }
            }),
            None => nearness_of(&conditions),
        };
        let done = match &table.spoiled {
            None => done,
            Some(text) => {
                let spoiled = self.asked(PhaseSetting::Spoiled, text, 0.0, names)?;
                let done = Done::Unless { spoiled: spoiled.truth.clone(), done: Box::new(done) };
                conditions.push(spoiled);
                done
            }
        };
        let phase = Phase {
            id: table.id.as_ref().clone(),
            description: table.description.as_ref().clone(),
            collaborative: table.collaborative,
            done,
            nearness,
        };
        Some((phase, conditions))
    }

    /// Returns the criterion of a phase and its conditions.
    fn done(&mut self, table: &PhaseTable, names: &Names) -> Option<(Done, Vec<PhaseCondition>)> {
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
                let asked = self.asked(PhaseSetting::Done, done, 0.0, names)?;
                Some((Done::When(asked.truth.clone()), vec![asked]))
            }
            (_, (Some(first), Some(then)), ..) => {
                let first = self.asked(PhaseSetting::First, first, 0.0, names);
                let then = self.asked(PhaseSetting::Then, then, 0.0, names);
                let broken = self.if_asked(PhaseSetting::Broken, broken, names);
                let (first, then, broken) = (first?, then?, broken?);
                let done = Done::Sequence {
                    first: first.truth.clone(),
                    then: then.truth.clone(),
                    broken: broken.as_ref().map(condition),
                };
                Some((done, [first, then].into_iter().chain(broken).collect()))
            }
            (_, _, (Some(lasting), Some(for_s)), _) => {
                let for_s = self.duration_s(for_s);
                let asked = self.asked(PhaseSetting::Lasting, lasting, for_s, names);
                let at_end = self.if_asked(PhaseSetting::AtEnd, at_end, names);
                let (asked, at_end) = (asked?, at_end?);
                let done = Done::Lasting {
                    condition: asked.truth.clone(),
                    for_s,
                    at_end: at_end.as_ref().map(condition),
                };
                Some((done, [asked].into_iter().chain(at_end).collect()))
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
    ) -> Option<(Done, Vec<PhaseCondition>)> {
        let mut conditions = Vec::new();
        for table in tables.as_ref() {
            let for_s = table.for_s.as_ref().map_or(0.0, |for_s| self.duration_s(for_s));
            conditions.push(self.asked(PhaseSetting::Milestone, &table.condition, for_s, names)?);
        }
        if conditions.is_empty() {
            let what = "no milestones; give some, for example [{ condition = '...' }, { condition = '...', for_s = 0.5 }]";
            self.wrong(tables.span(), what);
            return None;
        }
        let milestone =
            |asked: &PhaseCondition| Milestone { condition: condition(asked), for_s: asked.for_s };
        Some((Done::Milestones(conditions.iter().map(milestone).collect()), conditions))
    }

    /// Returns a condition of a phase with its parts.
    fn asked(
        &mut self,
        setting: PhaseSetting,
        text: &Spanned<String>,
        for_s: f64,
        names: &Names,
    ) -> Option<PhaseCondition> {
        let truth = self.condition(text, names)?;
        let placed = |part: ConditionPart| (self.place(part.at), part);
        let parts = self.parts(text, names)?.into_iter().map(placed).collect();
        Some(PhaseCondition { setting, for_s, truth, parts })
    }

    /// Reads an optional condition, as [`Reading::asked`] does; `None` if it has a mistake.
    fn if_asked(
        &mut self,
        setting: PhaseSetting,
        text: &Option<Spanned<String>>,
        names: &Names,
    ) -> Option<Option<PhaseCondition>> {
        match text {
            Some(text) => self.asked(setting, text, 0.0, names).map(Some),
            None => Some(None),
        }
    }

    /// Returns the parts of an expression that has no mistakes.
    fn parts(&self, text: &Spanned<String>, names: &Names) -> Option<Vec<ConditionPart>> {
        conditions::parts(text.as_ref(), place_in_file(&self.source.text, text), names).ok()
    }

    fn duration_s(&mut self, for_s: &Spanned<f64>) -> f64 {
        if !(0.0..=LONGEST_S).contains(for_s.as_ref()) {
            self.wrong(for_s.span(), format!("this may be 0 to {LONGEST_S} seconds, for example 0.5"));
        }
        *for_s.as_ref()
    }

    /// Returns a condition that the facts decide. A condition with a constant result is a mistake.
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

    /// Returns the meaning of an expression. A mistake in it is recorded at its position in the file.
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

/// Returns the default nearness of a phase: the mean nearness of the conditions that must hold to reach it.
fn nearness_of(conditions: &[PhaseCondition]) -> Nearness {
    let counts = |asked: &&PhaseCondition| match asked.setting {
        PhaseSetting::Done
        | PhaseSetting::First
        | PhaseSetting::Then
        | PhaseSetting::Lasting
        | PhaseSetting::Milestone => true,
        PhaseSetting::Broken | PhaseSetting::AtEnd | PhaseSetting::Spoiled => false,
    };
    let parts: Vec<Arc<Truth>> = conditions.iter().filter(counts).map(|asked| asked.truth.clone()).collect();
    Arc::new(move |facts: &Facts| {
        let sum: f32 = parts.iter().map(|part| part.nearness(facts)).sum();
        sum / parts.len() as f32
    })
}

fn condition(asked: &PhaseCondition) -> Condition {
    asked.truth.clone()
}
