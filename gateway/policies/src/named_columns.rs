//! Columns that a policy map names. Names are resolved once, when the map is read.

use std::{marker::PhantomData, ops::Range};

use serde::{Deserialize, Serialize};

use crate::columns::{action_range, state_range};

/// A row whose columns have names.
pub trait NamedRow {
    /// Returns the columns called `name`, or else the names that exist.
    fn find(name: &str) -> Result<Range<usize>, String>;
}

/// The row with a robot's state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateRow;

/// The row with all columns that a policy may command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommandRow;

impl NamedRow for StateRow {
    fn find(name: &str) -> Result<Range<usize>, String> {
        state_range(name)
    }
}

impl NamedRow for CommandRow {
    fn find(name: &str) -> Result<Range<usize>, String> {
        action_range(name)
    }
}

/// A block or a single column of a row, with its name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String", bound = "R: NamedRow + Clone")]
pub struct NamedColumns<R> {
    pub name: String,
    pub columns: Range<usize>,
    row: PhantomData<R>,
}

impl<R: NamedRow> TryFrom<String> for NamedColumns<R> {
    type Error = String;

    fn try_from(name: String) -> Result<NamedColumns<R>, String> {
        Ok(NamedColumns { columns: R::find(&name)?, name, row: PhantomData })
    }
}

impl<R> From<NamedColumns<R>> for String {
    fn from(named: NamedColumns<R>) -> String {
        named.name
    }
}

/// Returns the columns of all `names`, in the same order.
pub fn joined<R>(names: &[NamedColumns<R>]) -> Vec<usize> {
    names.iter().flat_map(|named| named.columns.clone()).collect()
}
