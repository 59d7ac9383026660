//! Tables as Markdown.

use super::Table;

/// Renders a table with its title and note.
pub fn markdown(table: &Table) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rules = (0..table.head.len()).map(|column| if column < table.figures_from { "---" } else { "---:" });
    let rows = table.rows.iter().enumerate().map(|(index, row)| {
        let cells = row.iter().enumerate().map(|(column, text)| match table.links.get(&(index, column)) {
            Some(to) => format!("[{}]({to})", escaped(text)),
            None => escaped(text),
        });
        line(&cells.collect::<Vec<_>>())
    });
    format!(
        "\n## {}\n\n{}\n\n{}|{}|\n{}",
        table.title,
        table.note,
        line(&table.head.iter().map(|text| escaped(text)).collect::<Vec<_>>()),
        rules.collect::<Vec<_>>().join("|"),
        rows.collect::<String>()
    )
}

fn escaped(cell: &str) -> String {
    cell.replace('|', "\\|").replace('\n', " ")
}
