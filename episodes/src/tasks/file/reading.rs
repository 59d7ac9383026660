//! Validation of a task file: collects mistakes and checks the properties common to all parts.

use std::ops::Range;

use toml::Spanned;

use super::error::{Mistakes, TaskFileError, line_and_column};
use super::filling::{filled, placeholders, told, unfilled_place};
use crate::conditions::nearest;
use crate::tasks::{ChosenOption, TaskSource};

/// Maximum length of an id, which also names folders, columns and results.
const LONGEST_ID: usize = 40;

/// A source under validation, with the mistakes found in it.
pub(super) struct Reading<'a> {
    source_as_written: &'a TaskSource,
    /// The source with the chosen options filled in; line breaks stay in place.
    pub source: TaskSource,
    chosen: &'a [ChosenOption],
    /// Mistakes by byte range in `source`.
    found: Vec<(Range<usize>, String)>,
}

impl<'a> Reading<'a> {
    pub fn new(written: &'a TaskSource, chosen: &'a [ChosenOption]) -> Reading<'a> {
        let source = TaskSource { text: filled(&written.text, chosen), ..written.clone() };
        Reading { source_as_written: written, source, chosen, found: Vec::new() }
    }

    /// Returns an error if any mistake has been found.
    pub fn checked(&mut self) -> Result<(), TaskFileError> {
        match self.found.is_empty() {
            true => Ok(()),
            false => Err(self.mistakes()),
        }
    }

    /// Takes the mistakes found, with positions in the written file.
    pub fn mistakes(&mut self) -> TaskFileError {
        let TaskSource { name, text, .. } = self.source_as_written;
        let written = |(at, what): (Range<usize>, String)| {
            let [start, end] = [at.start, at.end].map(|byte| unfilled_place(text, self.chosen, byte));
            (start..end, what + &told(&text[start..end], self.chosen))
        };
        let found = std::mem::take(&mut self.found).into_iter().map(written).collect();
        TaskFileError::Mistakes(Mistakes::new(name, text, found))
    }

    /// Returns the line and column in the written file of a byte of `source`.
    pub fn place(&self, at: usize) -> [usize; 2] {
        let text = &self.source_as_written.text;
        line_and_column(text, unfilled_place(text, self.chosen, at))
    }

    pub fn wrong(&mut self, at: Range<usize>, what: impl Into<String>) {
        self.found.push((at, what.into()));
    }

    /// Records a mistake in MJCF. For inline MJCF, the position is the line in the task file, not the
    /// start of the MJCF.
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

    /// Checks an id, which names folders, columns and results.
    pub fn id(&mut self, id: &Spanned<String>, whose: &str) {
        let text = id.as_ref();
        let plain =
            text.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_');
        if text.is_empty() || text.len() > LONGEST_ID || !plain || text == "all" {
            let what = format!(
                "{text:?} is no id of {whose}: give 1 to {LONGEST_ID} small letters, digits and _, for example pass_the_bottle"
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

/// Returns the byte offset of a text in the file, after its opening quotes. A text with escapes does not
/// appear verbatim; its offset is that of the quotes.
pub(super) fn place_in_file(file: &str, text: &Spanned<String>) -> usize {
    let span = text.span();
    let written = file.get(span.clone()).and_then(|written| written.find(text.as_ref().as_str()));
    span.start + written.unwrap_or_default()
}
