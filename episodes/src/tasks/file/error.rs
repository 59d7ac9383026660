//! Errors of task files, with the position of each mistake.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;

#[derive(Debug, thiserror::Error)]
pub enum TaskFileError {
    #[error("cannot read the task's file {}: {source}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    #[error(transparent)]
    Mjcf(#[from] tandem_sim::SimError),
    #[error("{0}")]
    Mistakes(Mistakes),
    #[error("{name} is not the file that was recorded: its hash is {now}, and {was} was recorded")]
    Changed { name: String, was: String, now: String },
}

/// Mistakes in a file, each formatted as `my_task.toml:12:8: the mistake and a hint`, followed by the
/// line itself.
#[derive(Debug, PartialEq, Eq)]
pub struct Mistakes(Vec<String>);

impl Mistakes {
    /// Formats the mistakes at these byte ranges of a text, sorted by position.
    pub fn new(name: &str, text: &str, mut found: Vec<(Range<usize>, String)>) -> Mistakes {
        found.sort_by_key(|(at, _)| at.start);
        Mistakes(found.into_iter().map(|(at, what)| shown(name, text, at, &what)).collect())
    }
}

impl fmt::Display for Mistakes {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0.join("\n"))
    }
}

/// Formats a mistake with its line below it and markers under the offending text.
fn shown(name: &str, text: &str, at: Range<usize>, what: &str) -> String {
    let start = floor_char(text, at.start);
    let [number, column] = line_and_column(text, start);
    let before = column - 1;
    let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
    let line = text[line_start..].lines().next().unwrap_or_default();
    let end = floor_char(text, at.end).clamp(start, line_start + line.len().max(start - line_start));
    let marks = text[start..end].chars().count().max(1);
    let margin = " ".repeat(number.to_string().len());
    let pad = " ".repeat(before);
    format!("{name}:{number}:{column}: {what}\n {number} | {line}\n {margin} | {pad}{}", "^".repeat(marks))
}

/// Returns the line and the column of a byte of a text, both counted from 1.
pub fn line_and_column(text: &str, byte: usize) -> [usize; 2] {
    let before = &text[..floor_char(text, byte)];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    [1 + before.matches('\n').count(), 1 + before[line_start..].chars().count()]
}

/// Returns the last character boundary at or before a byte.
fn floor_char(text: &str, byte: usize) -> usize {
    (0..=byte.min(text.len())).rev().find(|byte| text.is_char_boundary(*byte)).unwrap_or_default()
}
