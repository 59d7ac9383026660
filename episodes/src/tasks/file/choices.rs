//! The seed's choices in a task file: each `{name}` in its texts is replaced by an option. A file with
//! choices yields one task for each combination of options, all with one id and one hash.

use toml::Spanned;

use super::filling::placeholder;
use super::reading::Reading;
use super::table::ChoiceTable;
use crate::tasks::ChosenOption;

/// Maximum number of combinations. Each combination becomes a task.
const MAX_COMBINATIONS: usize = 64;

/// A choice as the file declares it.
pub(super) struct Choice {
    name: String,
    options: Vec<String>,
}

impl Reading<'_> {
    /// Returns the choices of a file and records their mistakes.
    pub fn choices(&mut self, tables: &[ChoiceTable]) -> Vec<Choice> {
        let mut found: Vec<Choice> = Vec::new();
        for table in tables {
            self.id(&table.name, "a choice");
            if found.iter().any(|choice| choice.name == *table.name.as_ref()) {
                self.wrong(table.name.span(), "there is a choice of this name already");
            }
            let options = table.options.as_ref();
            if options.len() < 2 {
                self.wrong(
                    table.options.span(),
                    "there is nothing to choose; give two options or more, for example [\"left\", \"right\"]",
                );
            }
            for (index, option) in options.iter().enumerate() {
                self.option(option, &options[..index]);
            }
            let placeholder = placeholder(table.name.as_ref());
            if !self.source.text.contains(&placeholder) {
                let what = format!("nothing in the file asks for it; write {placeholder} where it belongs");
                self.wrong(table.name.span(), what);
            }
            let options = options.iter().map(|option| option.as_ref().clone()).collect();
            found.push(Choice { name: table.name.as_ref().clone(), options });
            if found.iter().map(|choice| choice.options.len().max(1)).product::<usize>() > MAX_COMBINATIONS {
                self.wrong(0..0, format!("there are at most {MAX_COMBINATIONS} ways to choose in a file"));
                break;
            }
        }
        found
    }

    /// Checks an option, which must be valid inside the quotes of both TOML and expressions.
    fn option(&mut self, option: &Spanned<String>, before: &[Spanned<String>]) {
        let text = option.as_ref();
        if text.is_empty() || text.contains(['"', '\'', '\\', '{', '}']) || text.contains(char::is_control) {
            let what =
                "an option is a word or two without quotes, brackets and line breaks, for example \"left\"";
            self.wrong(option.span(), what);
        }
        if before.iter().any(|other| other.as_ref() == text) {
            self.wrong(option.span(), "this option is given twice");
        }
    }
}

/// Returns every combination of options in the order of the options; the last choice varies fastest.
pub(super) fn ways(choices: &[Choice]) -> Vec<Vec<ChosenOption>> {
    let mut ways = vec![Vec::new()];
    for Choice { name, options } in choices {
        let with = |way: &Vec<ChosenOption>, option: &String| {
            let chosen = ChosenOption { name: name.clone(), option: option.clone() };
            way.iter().cloned().chain([chosen]).collect()
        };
        ways = ways.iter().flat_map(|way| options.iter().map(move |option| with(way, option))).collect();
    }
    ways
}

/// Fills each placeholder with all of its options, for readers of an undecided task.
pub(super) fn with_options(text: &str, choices: &[Choice]) -> String {
    let fill = |text: String, choice: &Choice| {
        text.replace(&placeholder(&choice.name), &format!("[{}]", choice.options.join(" / ")))
    };
    choices.iter().fold(text.to_owned(), fill)
}
