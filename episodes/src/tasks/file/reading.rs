//! A task's file as it is looked through: what is found wrong with it, and what is asked of every part.

use std::ops::Range;

use toml::Spanned;

use super::error::{Mistakes, TaskFileError, line_and_column};
use super::filling::{filled, placeholders, told, unfilled_place};
use crate::conditions::nearest;
use crate::tasks::{ChosenOption, TaskSource};

/// Folders, columns and results are called so.
const LONGEST_ID: usize = 40;

/// A source as it is looked through, and what has been found wrong with it.
pub(super) struct Reading<'a> {
    source_as_written: &'a TaskSource,
    /// The same with what has been chosen in it; lines stay where they are.
    pub source: TaskSource,
    chosen: &'a [ChosenOption],
    /// By their places in `source`.
    found: Vec<(Range<usize>, String)>,
}

impl<'a> Reading<'a> {
    pub fn new(written: &'a TaskSource, chosen: &'a [ChosenOption]) -> Reading<'a> {
        let source = TaskSource { text: filled(&written.text, chosen), ..written.clone() };
        Reading { source_as_written: written, source, chosen, found: Vec::new() }
    }

    /// Whether nothing has been found wrong.
    pub fn checked(&mut self) -> Result<(), TaskFileError> {
        match self.found.is_empty() {
            true => Ok(()),
            false => Err(self.mistakes()),
        }
    }

    /// What has been found wrong, by the file's own lines.
    pub fn mistakes(&mut self) -> TaskFileError {
        let TaskSource { name, text, .. } = self.source_as_written;
        let written = |(at, what): (Range<usize>, String)| {
            let [start, end] = [at.start, at.end].map(|byte| unfilled_place(text, self.chosen, byte));
            (start..end, what + &told(&text[start..end], self.chosen))
        };
        let found = std::mem::take(&mut self.found).into_iter().map(written).collect();
        TaskFileError::Mistakes(Mistakes::new(name, text, found))
    }

    /// The line and the column of the file itself at which that stands which is at this byte of `source`.
    pub fn place(&self, at: usize) -> [usize; 2] {
        let text = &self.source_as_written.text;
        line_and_column(text, unfilled_place(text, self.chosen, at))
    }

    pub fn wrong(&mut self, at: Range<usize>, what: impl Into<String>) {
        self.found.push((at, what.into()));
    }

    /// What is wrong with MJCF. Where that stands in the task's file itself, it is told by the file's line and not by where the MJCF begins.
    pub fn wrong_mjcf(&mut self, at: Range<usize>, what: String) {
        let inline = what.strip_prefix(&format!("`{}:", self.source.name)).and_then(|rest| {
            let (line, what) = rest.split_once("`: ")?;
            let mut lines = self.source.text.split_inclusive('\n');
            let above = line.parse::<usize>().ok()?.checked_sub(1)?;
            let start: usize = lines.by_ref().take(above).map(str::len).sum();
            let text = lines.next()?;
            let indent = text.len() - text.trim_start().len();
            Some((start + indent..start + text.trim_end().len(), what.to_owned()))
        });
        let (at, what) = inline.unwrap_or((at, what));
        self.wrong(at, what);
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
        for (at, name) in placeholders(text.as_ref()) {
            let start = place_in_file(&self.source.text, text) + at;
            let known: Vec<&str> = self.chosen.iter().map(|chosen| chosen.name.as_str()).collect();
            let have = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            let near = nearest(name, known.iter().copied());
            let what = format!("no choice {name:?}{near}; [[choices]] have: {have}");
            self.wrong(start..start + name.len() + 2, what);
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
