//! Conditions that somebody writes into a task's file: expressions over [`crate::Facts`], in a small typed part of the
//! Common Expression Language. `syntax` reads them, `check` finds out what they mean, `functions` lists the facts, and
//! `meaning` is what is left to evaluate at every control step.

mod check;
mod functions;
mod meaning;
mod syntax;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

use tandem_sim::ObjectModel;

pub use check::nearest;
pub use functions::{FUNCTIONS, Function, OF_FINGERS};
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

#[cfg(test)]
mod tests;
