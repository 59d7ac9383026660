//! Information about the program itself: tasks, examples, manual pages and shell completions.

pub mod completions;
pub mod examples;
pub mod man;
pub mod robots;
pub mod tasks;

use std::path::Path;

/// Returns the path of `file` as the file `by` names it: relative to the folder of `by` if it is inside.
fn seen_from(by: &Path, file: &Path) -> String {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.into());
    let (by, file) = (absolute(by), absolute(file));
    let below = by.parent().and_then(|folder| file.strip_prefix(folder).ok());
    below.unwrap_or(&file).to_string_lossy().replace('\\', "/")
}
