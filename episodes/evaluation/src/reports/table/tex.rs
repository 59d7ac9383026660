//! Tables as LaTeX, for documents with the packages `booktabs`, `graphicx` and `longtable`.

use super::Table;

/// Maximum number of rows on one page; longer tables continue on further pages.
const MAX_PAGE_ROWS: usize = 40;
/// Length in characters from which a column's texts are broken into lines.
const LONG_TEXT_CHARS: usize = 36;
/// Command that scales the table that follows to the width of the text if it is wider.
const WITHIN_THE_PAGE: &str = r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}";

/// Renders a table with its title and note as the caption.
pub fn tex(table: &Table) -> String {
    let line = |cells: &[String]| format!("    {} \\\\\n", row(cells));
    let caption = format!("\\caption{{\\textbf{{{}.}} {}}}", escape_tex(&table.title), marked(&table.note));
    let head = format!("    \\toprule\n{}    \\midrule\n", line(&table.head));
    let rows: String = table.rows.iter().map(|row| line(row)).collect();
    let columns = columns(table);
    match table.rows.len() > MAX_PAGE_ROWS {
        true => format!(
            "\n{{\\small\n\\begin{{longtable}}{{{columns}}}\n    {caption} \\\\\n{head}    \\endfirsthead\n{head}    \\endhead\n    \
             \\bottomrule\n    \\endfoot\n{rows}\\end{{longtable}}\n}}\n"
        ),
        false => format!(
            "\n\\begin{{table}}\n  \\centering\n  {caption}\n  \\small\n  {WITHIN_THE_PAGE}{{%\n  \
             \\begin{{tabular}}{{{columns}}}\n{head}{rows}    \\bottomrule\n  \\end{{tabular}}}}\n\\end{{table}}\n"
        ),
    }
}

/// Returns the column specifications. Texts that would exceed the page's width are broken into lines.
fn columns(table: &Table) -> String {
    let is_long = |column: usize| {
        let cells = table.rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max() > Some(LONG_TEXT_CHARS)
    };
    let long_columns = (0..table.head.len()).filter(|column| is_long(*column)).count();
    let broken = format!("p{{{:.2}\\linewidth}}", 0.6 / long_columns.max(1) as f64);
    let column = |column: usize| match (is_long(column), column < table.figures_from) {
        (true, _) => broken.as_str(),
        (false, true) => "l",
        (false, false) => "r",
    };
    (0..table.head.len()).map(column).collect()
}

/// Joins the cells of a row. At the beginning of a row, LaTeX would parse a bracket or a star as an argument
/// of the preceding line break.
fn row(cells: &[String]) -> String {
    let text = cells.iter().map(|cell| escape_tex(cell)).collect::<Vec<_>>().join(" & ");
    if text.starts_with(['[', '*']) { format!("{{}}{text}") } else { text }
}

/// Escapes a text for LaTeX. Parts in backticks are set in typewriter type.
fn marked(text: &str) -> String {
    let part = |(index, part): (usize, &str)| match index % 2 {
        0 => escape_tex(part),
        _ => format!("\\texttt{{{}}}", escape_tex(part)),
    };
    text.split('`').enumerate().map(part).collect()
}

/// Escapes a text for LaTeX. Characters that engines without Unicode fonts cannot set are written as code
/// points.
pub fn escape_tex(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => escaped.extend(['\\', character]),
            '\\' => escaped += "\\textbackslash{}",
            '~' => escaped += "\\textasciitilde{}",
            '^' => escaped += "\\textasciicircum{}",
            '|' => escaped += "\\textbar{}",
            '<' => escaped += "$<$",
            '>' => escaped += "$>$",
            'π' => escaped += "$\\pi$",
            'Ψ' => escaped += "$\\Psi$",
            'µ' => escaped += "$\\mu$",
            '×' => escaped += "$\\times$",
            '±' => escaped += "$\\pm$",
            '≤' => escaped += "$\\le$",
            '≥' => escaped += "$\\ge$",
            '°' => escaped += "$^\\circ$",
            '–' => escaped += "--",
            '’' => escaped.push('\''),
            // LaTeX would typeset two consecutive hyphens as a dash.
            '-' if escaped.ends_with('-') => escaped += "{}-",
            character if character.is_whitespace() => escaped.push(' '),
            character if character.is_ascii_graphic() || is_accented(character) => escaped.push(character),
            other => escaped += &format!("[U+{:04X}]", u32::from(other)),
        }
    }
    escaped
}

/// Returns `true` for Latin letters with accents, which LaTeX sets in every font encoding.
fn is_accented(character: char) -> bool {
    ('À'..='ÿ').contains(&character) && !"ÐÞðþ÷".contains(character)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_means_something_in_latex_is_escaped() {
        for (text, expected) in [
            ("50 % of a_b & c#d $1 {e}", r"50 \% of a\_b \& c\#d \$1 \{e\}"),
            (r"C:\a~b^c", r"C:\textbackslash{}a\textasciitilde{}b\textasciicircum{}c"),
            ("a|b<c>`d`", r"a\textbar{}b$<$c$>$`d`"),
            ("evaluate --spread", "evaluate -{}-spread"),
            ("a\n\nb\tc", "a  b c"),
            ("π0.5 naïve 代 þ\u{7} 3–4°", r"$\pi$0.5 naïve [U+4EE3] [U+00FE][U+0007] 3--4$^\circ$"),
        ] {
            assert_eq!(escape_tex(text), expected);
        }
        assert_eq!(marked("use `--a_b` twice"), r"use \texttt{-{}-a\_b} twice");
        assert_eq!(row(&["[x]".into(), "*".into()]), "{}[x] & *");
    }

    /// The begin and end commands of each environment match for any number of rows.
    #[test]
    fn long_tables_are_broken_across_pages() {
        for (rows, expected, absent) in
            [(MAX_PAGE_ROWS, "\\end{tabular}", "longtable"), (MAX_PAGE_ROWS + 1, "\\endhead", "\\end{table}")]
        {
            let mut table = Table::new("Title", "note", &["Word", "Why", "Figure"], 2);
            table.rows = vec![vec!["a".into(), "b".repeat(LONG_TEXT_CHARS + 1), "1".into()]; rows];
            let text = tex(&table);
            assert!(text.contains(expected) && !text.contains(absent), "{rows} rows: {text}");
            assert!(text.contains("{lp{0.60\\linewidth}r}"), "{text}");
        }
    }
}
