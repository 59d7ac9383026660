//! Python as text: indented lines, imports, and docstrings.

use std::collections::BTreeSet;

const LONGEST_LINE: usize = 118;

/// Lines of a module.
#[derive(Default)]
pub struct Lines(String);

impl Lines {
    /// Writes the header of a module.
    pub fn head(&mut self, about: &str) {
        self.add(0, &format!("\"\"\"{about}\n"));
        self.add(
            0,
            "Written by the tests of `tools_spec` from the one list of tools; not to be edited.\n\"\"\"\n",
        );
        self.add(0, "from __future__ import annotations\n");
    }

    /// Adds a line, indented by a number of levels.
    pub fn add(&mut self, level: usize, line: &str) {
        if !line.is_empty() {
            self.0.push_str(&"    ".repeat(level));
        }
        self.0.push_str(line);
        self.0.push('\n');
    }

    /// Imports names from another module of the contract, if there are any.
    pub fn import(&mut self, module: &str, names: impl Iterator<Item = String>) {
        let names: BTreeSet<String> = names.collect();
        let mut names: Vec<String> = names.into_iter().collect();
        // Names are sorted like by ruff: classes before functions.
        names.sort_by_key(|name| (name.starts_with(char::is_lowercase), name.clone()));
        let whole = format!("from .{module} import {}", names.join(", "));
        match names.len() {
            0 => {}
            _ if whole.len() <= LONGEST_LINE => self.add(0, &whole),
            _ => {
                self.add(0, &format!("from .{module} import ("));
                names.iter().for_each(|name| self.add(1, &format!("{name},")));
                self.add(0, ")");
            }
        }
    }

    pub fn text(self) -> String {
        format!("{}\n", self.0.trim_end())
    }
}

/// Adds a docstring, with an entry for each argument of a function.
pub fn docstring(lines: &mut Lines, level: usize, text: &str, arguments: &[String]) {
    if text.is_empty() && arguments.is_empty() {
        return;
    }
    let width = LONGEST_LINE - 4 * level;
    let first = wrapped(text, width - 6, 0);
    if let ([line], []) = (first.as_slice(), arguments) {
        return lines.add(level, &format!("\"\"\"{line}\"\"\""));
    }
    for (index, line) in first.iter().enumerate() {
        lines.add(level, &format!("{}{line}", if index == 0 { "\"\"\"" } else { "" }));
    }
    if !arguments.is_empty() {
        lines.add(0, "");
        lines.add(level, "Args:");
    }
    for argument in arguments {
        wrapped(argument, width - 4, 4).iter().for_each(|line| lines.add(level + 1, line));
    }
    lines.add(level, "\"\"\"");
}

/// Breaks a text into lines of at most `width` characters. All lines but the first are indented by `hanging`.
fn wrapped(text: &str, width: usize, hanging: usize) -> Vec<String> {
    let text = text.replace('\\', "\\\\").replace("\"\"\"", "'''");
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.last_mut().expect("there is one");
        if !last.trim().is_empty() && last.len() + 1 + word.len() > width {
            lines.push(format!("{}{word}", " ".repeat(hanging)));
        } else {
            if !last.trim().is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    lines
}
