//! A task's file as it is looked through: what is found wrong with it, and what is asked of every part.

use std::ops::Range;

use toml::Spanned;

use super::error::{Mistakes, TaskFileError};
use crate::tasks::TaskSource;

/// Folders, columns and results are called so.
const LONGEST_ID: usize = 40;

/// A source as it is looked through, and what has been found wrong with it.
pub(super) struct Reading<'a> {
    pub source: &'a TaskSource,
    pub found: Vec<(Range<usize>, String)>,
}

impl Reading<'_> {
    /// Whether nothing has been found wrong.
    pub fn checked(&mut self) -> Result<(), TaskFileError> {
        match self.found.is_empty() {
            true => Ok(()),
            false => Err(self.mistakes()),
        }
    }

    /// What has been found wrong.
    pub fn mistakes(&mut self) -> TaskFileError {
        let found = std::mem::take(&mut self.found);
        TaskFileError::Mistakes(Mistakes::new(&self.source.name, &self.source.text, found))
    }

    pub fn wrong(&mut self, at: Range<usize>, what: impl Into<String>) {
        self.found.push((at, what.into()));
    }

    /// A name of which folders, columns and results are made.
    pub fn id(&mut self, id: &Spanned<String>, whose: &str) {
        let text = id.as_ref();
        let plain =
            text.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_');
        if text.is_empty() || text.len() > LONGEST_ID || !plain || text == "all" {
            let what = format!(
                "{text:?} is no id of {whose}: give 1 to {LONGEST_ID} small letters, digits and _, as pass_the_bottle"
            );
            self.wrong(id.span(), what);
        }
    }

    pub fn words(&mut self, text: &Spanned<String>) {
        if text.as_ref().trim().is_empty() {
            self.wrong(text.span(), "this is empty, and nobody would know what to do or what it means");
        }
    }
}

/// Where a text of the file begins behind its quotes. One with escapes in it does not stand there as it is; then it is where its
/// quotes are.
pub(super) fn place_in_file(file: &str, text: &Spanned<String>) -> usize {
    let span = text.span();
    let written = file.get(span.clone()).and_then(|written| written.find(text.as_ref().as_str()));
    span.start + written.unwrap_or_default()
}

/// A text for as long as the program runs.
pub(super) fn lasting(text: &str) -> &'static str {
    String::leak(text.to_owned())
}
