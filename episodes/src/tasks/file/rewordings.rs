//! Rewordings of a task's instructions, one set for each stress level.

use toml::Spanned;

use super::reading::Reading;
use super::table::RewordingTable;
use crate::tasks::{RobotSpot, TaskWords};

/// Number of stress levels, and so of rewordings.
const LEVELS: usize = 3;

impl Reading<'_> {
    /// Returns the file's rewordings and records their mistakes.
    pub fn rewordings(
        &mut self,
        tables: &Option<Spanned<Vec<RewordingTable>>>,
        shared: &Option<Spanned<String>>,
        robots: &[RobotSpot],
    ) -> Option<[TaskWords; LEVELS]> {
        let tables = tables.as_ref()?;
        if tables.as_ref().len() != LEVELS {
            let what = format!("there are {LEVELS} [[rewordings]] or none: for levels 1, 2 and 3");
            self.wrong(tables.span(), what);
        }
        for table in tables.as_ref() {
            self.words(&table.instruction);
            table.shared_instruction.iter().for_each(|text| self.words(text));
            table.robots.values().for_each(|text| self.words(text));
            match (shared, &table.shared_instruction) {
                (Some(_), None) => self.wrong(
                    table.instruction.span(),
                    "the file has a shared_instruction, and so has each of [[rewordings]]",
                ),
                (None, Some(given)) => self.wrong(
                    given.span(),
                    "the file has no shared_instruction to word anew; leave this out, or give one above",
                ),
                (Some(_), Some(_)) | (None, None) => {}
            }
            let names = || robots.iter().map(|robot| robot.name);
            if !table.robots.keys().map(String::as_str).eq(names()) {
                let names: Vec<String> = names().map(|name| format!("{name} = \"...\"")).collect();
                let what = format!("give words for each robot: {{ {} }}", names.join(", "));
                self.wrong(table.instruction.span(), what);
            }
        }
        in_words(tables.as_ref(), |text| text.as_ref().clone())
    }
}

/// Returns rewordings with `made` applied to each text; `None` unless there is one for each level.
pub(super) fn in_words(
    tables: &[RewordingTable],
    made: impl Fn(&Spanned<String>) -> String,
) -> Option<[TaskWords; LEVELS]> {
    let words = |table: &RewordingTable| TaskWords {
        joint: made(&table.instruction),
        shared: table.shared_instruction.as_ref().map(&made),
        robots: table.robots.values().map(&made).collect(),
    };
    tables.iter().map(words).collect::<Vec<_>>().try_into().ok()
}
