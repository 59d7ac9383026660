//! Conditions in task files: expressions over [`crate::Facts`], in a small typed subset of the Common
//! Expression Language. `syntax` parses them, `check` resolves names and types, and `functions` lists the
//! facts. `meaning` is the checked form, evaluated at every control step; `lacks` explains why a fact
//! does not hold.

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

/// The names available to a task's expressions.
#[derive(Debug, Default)]
pub struct Names {
    /// Robots in the order of [`crate::Facts::robots`].
    pub robots: Vec<String>,
    /// Objects and their movable parts.
    pub objects: BTreeMap<String, Arc<ObjectModel>>,
    /// The file's terms: named expressions.
    pub terms: BTreeMap<String, Meaning>,
    /// Terms with mistakes; a reference to one is not a further mistake.
    pub mistaken_terms: BTreeSet<String>,
    pub mistaken_objects: BTreeSet<String>,
    /// Parts of each term that is a condition.
    pub parts_of_terms: BTreeMap<String, Vec<ConditionPart>>,
}

/// One of the parts that must all hold for a condition to hold.
#[derive(Clone, Debug)]
pub struct ConditionPart {
    /// Byte offset in the file.
    pub at: usize,
    /// Text of the part in the file, for readers: white space is single, and numbers have five digits at most.
    pub text: String,
    pub truth: Arc<Truth>,
}

impl ConditionPart {
    /// Returns true if another part has the same text and meaning, including the terms that it refers to.
    pub fn asks_the_same(&self, other: &ConditionPart) -> bool {
        let meaning = |part: &ConditionPart| format!("{:?}", part.truth);
        self.text == other.text && meaning(self) == meaning(other)
    }

    /// Explains why the part does not hold, in sentences; empty if it holds.
    pub fn lacks(&self, facts: &Facts) -> Vec<String> {
        let Self { text, truth, .. } = self;
        if truth.holds(facts) {
            return Vec::new();
        }
        // The addition removes the sign of a negative zero.
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

/// A mistake in an expression, with a hint at a valid form.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// Byte range in the expression.
    pub at: Range<usize>,
    pub text: String,
}

impl Mistake {
    /// Returns true if the mistake merely follows from one reported elsewhere.
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

/// Reads an expression that is a condition.
pub fn condition(text: &str, names: &Names) -> Result<Arc<Truth>, Mistake> {
    check::truth(&syntax::read(text)?, names)
}

/// Reads an expression that is a number.
pub fn number(text: &str, names: &Names) -> Result<Arc<Number>, Mistake> {
    check::number(&syntax::read(text)?, names)
}

/// Reads an expression of either type, which a file names as a term.
pub fn term(text: &str, names: &Names) -> Result<Meaning, Mistake> {
    check::meaning(&syntax::read(text)?, names)
}

/// Splits a condition into the parts joined by `&&`. Terms are replaced by their own parts. `starts_at`
/// is the byte offset of the condition in its file.
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
                text: readable(&text[node.at.clone()]),
                truth: check::truth(node, names)?,
            }),
        }
    }
    Ok(found)
}

/// Returns an expression with single spaces, and with five digits of numbers that have more than four
/// decimals.
fn readable(text: &str) -> String {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let is_digit = |letter: char| letter.is_ascii_digit() || letter == '.';
    let mut shown = String::new();
    let mut rest = &text[..];
    while let Some(start) = rest.find(is_digit) {
        let length = rest[start..].find(|letter| !is_digit(letter)).unwrap_or(rest.len() - start);
        let (before, number) = (&rest[..start], &rest[start..start + length]);
        let has_more = number.split_once('.').is_some_and(|(_, decimals)| decimals.len() > 4);
        let value: Option<f64> = number.parse().ok().filter(|_| has_more);
        let short: Option<f64> = value.and_then(|value: f64| format!("{value:.4e}").parse().ok());
        shown += before;
        shown += &short.map_or_else(|| number.to_owned(), |short| short.to_string());
        rest = &rest[start + length..];
    }
    shown + rest
}

#[cfg(test)]
mod tests;
