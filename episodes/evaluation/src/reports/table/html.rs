//! Tables as HTML.

use tandem_episodes::html::escape;

use super::Table;

/// Renders a table with its title and note.
pub fn html(table: &Table) -> String {
    let head: String = table
        .head
        .iter()
        .enumerate()
        .map(|(column, text)| cell(table, "th", column, &escape(text)))
        .collect();
    let grouped = (0..table.rows.len()).any(|index| same_as_above(table, index) > 0);
    let mut rows = String::new();
    for (index, row) in table.rows.iter().enumerate() {
        let same = same_as_above(table, index);
        let cells = row.iter().enumerate().map(|(column, text)| {
            let content = match table.links.get(&(index, column)) {
                Some(to) => format!(r#"<a href="{}">{}</a>"#, escape(to), escape(text)),
                None if column < same => String::new(),
                None => escape(text),
            };
            cell(table, "td", column, &content)
        });
        let class = if same == 0 && index > 0 && grouped { r#" class="first""# } else { "" };
        rows += &format!("<tr{class}>{}</tr>", cells.collect::<String>());
    }
    format!(
        r#"<h2>{title}</h2><p class="soft">{}</p><div class="scroll" tabindex="0" role="region" aria-label="{title}"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"#,
        marked(&table.note),
        title = escape(&table.title),
    )
}

fn cell(table: &Table, tag: &str, column: usize, content: &str) -> String {
    let class = if column < table.figures_from { "" } else { r#" class="number""# };
    format!("<{tag}{class}>{content}</{tag}>")
}

/// Returns the number of leading cells with the same texts as in the row above, which are not repeated.
fn same_as_above(table: &Table, index: usize) -> usize {
    let above = index.checked_sub(1).map_or(&[][..], |above| &table.rows[above][..table.figures_from]);
    let same = table.rows[index].iter().zip(above).take_while(|(one, other)| one == other).count();
    same.min(table.figures_from.saturating_sub(1))
}

/// Converts text to HTML. Parts in backticks become code.
pub fn marked(text: &str) -> String {
    let part = |(index, part): (usize, &str)| match index % 2 {
        0 => escape(part),
        _ => format!("<code>{}</code>", escape(part)),
    };
    text.split('`').enumerate().map(part).collect()
}
