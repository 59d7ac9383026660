//! Reports as LaTeX.

use super::*;

/// Returns the report of policies whose names and notes contain all characters that LaTeX reads as commands.
fn report() -> String {
    let mut episodes = nine_six_three(r"[a] #1_{x} 50% & $\begin{x} ~^|<>");
    for (index, name) in ["*π 代", "--b", "`c`\n\nd"].into_iter().enumerate() {
        let mut failed = played(name, &tasks::cohub()[index], 3, 1);
        failed.note = Some(format!(r"\end{{table}} {name} & 100 % of C:\a_b"));
        episodes.push(failed);
    }
    let mut report = EvaluationReport::of(&found(episodes));
    report.skipped.push("torn.json: no\n\\JSON".into());
    report.write(ReportFormat::Tex, &ReportPictures::default()).unwrap()
}

/// Returns the names of the environments that `text` begins or ends, in their order.
fn environments(text: &str) -> Vec<(bool, String)> {
    let mut found = Vec::new();
    for (index, _) in text.match_indices('\\') {
        for (command, begins) in [("\\begin{", true), ("\\end{", false)] {
            if let Some(rest) = text[index..].strip_prefix(command) {
                found.push((begins, rest.split('}').next().unwrap_or_default().into()));
            }
        }
    }
    found
}

#[test]
fn every_environment_ends_where_it_should() {
    let text = report();
    let mut open = Vec::new();
    for (begins, name) in environments(&text) {
        match begins {
            true => open.push(name),
            false => assert_eq!(open.pop(), Some(name), "{text}"),
        }
    }
    assert!(open.is_empty() && text.matches("\\begin{tabular}").count() > 8, "{open:?}: {text}");
}

/// Every row has a cell for each column, and contains only the commands that we write.
#[test]
fn rows_have_the_columns_of_their_tables() {
    let text = report();
    let mut columns = None;
    let mut rows = 0;
    for line in text.lines() {
        if let Some(specification) = line.trim().strip_prefix("\\begin{tabular}{") {
            columns = Some(count_columns(specification));
        }
        let Some(row) = line.trim().strip_suffix(" \\\\") else { continue };
        let cells = row.replace("\\&", "").matches('&').count() + 1;
        assert_eq!(Some(cells), columns, "{line}");
        assert!(!row.starts_with(['[', '*']), "an argument of the line before: {line}");
        let plain = ["\\textbackslash{}", "\\%", "\\#", "\\_", "\\{", "\\}", "\\$"]
            .iter()
            .fold(row.to_owned(), |text, escaped| text.replace(escaped, ""));
        assert!(!plain.contains(['%', '#', '_']) && plain.is_ascii(), "{line}");
        rows += 1;
    }
    assert!(rows > 30, "{rows} rows");
    assert!(text.contains("% Left out: torn.json: no \\JSON\n"), "{text}");
}

/// Counts the columns of a specification such as `lp{0.60\linewidth}r}`.
fn count_columns(specification: &str) -> usize {
    let mut depth = 0;
    let mut columns = 0;
    for letter in specification.chars() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            'l' | 'r' | 'p' if depth == 0 => columns += 1,
            _ => {}
        }
    }
    columns
}
