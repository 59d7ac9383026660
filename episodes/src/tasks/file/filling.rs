//! Substitution of the chosen options for the placeholders `{name}` in the texts of a task file.

use crate::tasks::ChosenOption;

/// Returns a text with its placeholders replaced by the chosen options.
pub(super) fn filled(text: &str, way: &[ChosenOption]) -> String {
    let fill = |text: String, chosen: &ChosenOption| text.replace(&placeholder(&chosen.name), &chosen.option);
    way.iter().fold(text.to_owned(), fill)
}

/// Maps a byte position in the filled text back to the written text. A position within an option maps to
/// the start of its placeholder.
pub(super) fn unfilled_place(text: &str, way: &[ChosenOption], filled_at: usize) -> usize {
    let (mut at, mut filled_to) = (0, 0);
    while let Some(letter) = text[at..].chars().next() {
        let placed = |chosen: &&ChosenOption| text[at..].starts_with(&placeholder(&chosen.name));
        let (written, shown) = match way.iter().find(placed) {
            Some(chosen) => (placeholder(&chosen.name).len(), chosen.option.len()),
            None => (letter.len_utf8(), letter.len_utf8()),
        };
        if filled_at < filled_to + shown {
            break;
        }
        (at, filled_to) = (at + written, filled_to + shown);
    }
    at
}

/// Yields the names in `{...}` in a text, each with the offset of its brace.
pub(super) fn placeholders(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.match_indices('{').filter_map(|(at, _)| {
        let name = text[at + 1..].split_once('}')?.0;
        let plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        (!name.is_empty() && name.chars().all(plain)).then_some((at, name))
    })
}

/// Returns a suffix for the mistakes of a text, for example " (with wanted = green)"; empty if the text
/// has no chosen option.
pub(super) fn told(text: &str, way: &[ChosenOption]) -> String {
    let of_text = way.iter().filter(|chosen| text.contains(&placeholder(&chosen.name)));
    let told: Vec<String> = of_text.map(|chosen| format!("{} = {}", chosen.name, chosen.option)).collect();
    if told.is_empty() { String::new() } else { format!(" (with {})", told.join(", ")) }
}

/// Returns the placeholder of a choice.
pub(super) fn placeholder(name: &str) -> String {
    format!("{{{name}}}")
}
