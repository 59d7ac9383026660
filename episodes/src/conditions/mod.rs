//! Conditions that somebody writes into a task's file: expressions over [`crate::Facts`], in a small typed part of the
//! Common Expression Language. `syntax` reads them, `check` finds out what they mean, `functions` lists the facts,
//! `meaning` is what is left to evaluate at every control step, and `lacks` says in sentences why a fact does not hold.

mod check;
mod functions;
mod lacks;
mod meaning;
mod syntax;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

use tandem_sim::ObjectModel;

use crate::scoring::{Facts, Predicate};

pub use check::nearest;
pub use functions::{FUNCTIONS, Function, OF_FINGERS};
use meaning::{Fact, Statement};
pub use meaning::{Meaning, Number, Truth};

/// What an expression of a task may name.
#[derive(Debug, Default)]
pub struct Names {
    /// In the order of [`crate::Facts::robots`].
    pub robots: Vec<String>,
    /// Objects, and what moves on them.
    pub objects: BTreeMap<String, Arc<ObjectModel>>,
    /// Names that the file has given to expressions.
    pub terms: BTreeMap<String, Meaning>,
    /// Names of expressions and of objects in which mistakes were found: who uses them makes none.
    pub mistaken_terms: BTreeSet<String>,
    pub mistaken_objects: BTreeSet<String>,
    /// What the terms that are conditions are made of.
    pub parts_of_terms: BTreeMap<String, Vec<ConditionPart>>,
}

/// Something that has to hold, with others, for a condition to hold.
#[derive(Clone, Debug)]
pub struct ConditionPart {
    /// The byte of the file at which it begins.
    pub at: usize,
    /// As it is written.
    pub text: String,
    pub truth: Arc<Truth>,
}

impl ConditionPart {
    /// Returns whether another part asks for the same, also in the terms that it names.
    pub fn asks_the_same(&self, other: &ConditionPart) -> bool {
        let meaning = |part: &ConditionPart| format!("{:?}", part.truth);
        self.text == other.text && meaning(self) == meaning(other)
    }

    /// Returns what it lacks to hold, one sentence each. Empty where it holds.
    pub fn lacks(&self, facts: &Facts) -> Vec<String> {
        let Self { text, truth, .. } = self;
        if truth.holds(facts) {
            return Vec::new();
        }
        // Without the sign of a zero.
        let now = |value: f64| (value * 1e3).round() / 1e3 + 0.0;
        match &**truth {
            Truth::Compared { sides, .. } => {
                let [left, right] = sides.each_ref().map(|side| now(side.value(facts)));
                match &*sides[1] {
                    Number::Value(_) => vec![format!("{text}: it is {left}")],
                    _ => vec![format!("{text}: it is {left} and {right}")],
                }
            }
            Truth::Fact { statement: Statement { lacks: Some(lacks), .. }, arguments } => {
                lacks(&Fact { facts, arguments })
            }
            _ => vec![format!("{text} does not hold")],
        }
    }
}

/// What is wrong with an expression, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// The bytes of the expression that are meant.
    pub at: Range<usize>,
    pub text: String,
}

impl Mistake {
    /// Whether it only follows from a mistake that is told elsewhere.
    pub fn follows(&self) -> bool {
        self.text.is_empty()
    }

    fn following(at: Range<usize>) -> Mistake {
        Mistake::new(at, "")
    }

    fn new(at: Range<usize>, text: impl Into<String>) -> Mistake {
        Mistake { at, text: text.into() }
    }
}

/// Reads an expression that either holds or does not.
pub fn condition(text: &str, names: &Names) -> Result<Arc<Truth>, Mistake> {
    check::truth(&syntax::read(text)?, names)
}

/// Reads an expression that is a number.
pub fn number(text: &str, names: &Names) -> Result<Arc<Number>, Mistake> {
    check::number(&syntax::read(text)?, names)
}

/// Reads an expression of either kind, for which a file has a name.
pub fn term(text: &str, names: &Names) -> Result<Meaning, Mistake> {
    check::meaning(&syntax::read(text)?, names)
}

/// What has to hold at once where a condition holds that begins at this byte of its file: the parts that it joins by `&&`, and in the
/// place of a term the parts of that.
pub fn parts(text: &str, starts_at: usize, names: &Names) -> Result<Vec<ConditionPart>, Mistake> {
    let mut found = Vec::new();
    for node in check::joined(&syntax::read(text)?) {
        let of_term = match &node.kind {
            syntax::NodeKind::Name(name) => names.parts_of_terms.get(name),
            _ => None,
        };
        match of_term {
            Some(parts) => found.extend_from_slice(parts),
            None => found.push(ConditionPart {
                at: starts_at + node.at.start,
                text: text[node.at.clone()].split_whitespace().collect::<Vec<_>>().join(" "),
                truth: check::truth(node, names)?,
            }),
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests;
