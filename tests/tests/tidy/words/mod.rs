//! Tests of the wording of comments and names.

use syn::visit::{self, Visit};

use super::sources::{Source, everywhere, expect_none};

/// Question words, with which no comment may begin.
const QUESTIONS: [&str; 9] = ["What", "Where", "Who", "Whether", "Of", "As", "How", "Which", "Whose"];
/// Maximum length of a line with a comment, in columns.
const MAX_COMMENT_COLUMNS: usize = 112;

/// Returns the first line of every doc comment, with its number.
fn first_lines(source: &Source) -> Vec<(usize, &str)> {
    let text = |line: &'_ str| -> Option<usize> {
        let line = line.trim_start();
        ["///", "//!"].iter().any(|mark| line.starts_with(mark)).then_some(3)
    };
    let lines: Vec<&str> = source.text.lines().collect();
    let is_first = |number: usize| number == 0 || text(lines[number - 1]).is_none();
    let docs = lines.iter().enumerate().filter(|(number, line)| text(line).is_some() && is_first(*number));
    docs.map(|(number, line)| (number + 1, line.trim_start()[3..].trim())).collect()
}

#[test]
fn comments_begin_with_what_there_is() {
    let mut found = Vec::new();
    for source in everywhere(&["rs"]) {
        for (number, line) in first_lines(&source) {
            let word = line.split(' ').next().unwrap_or_default();
            if QUESTIONS.contains(&word) {
                found.push(format!("{}:{number}: {line}", source.path.display()));
            }
        }
    }
    expect_none(
        &found,
        "begin a function's comment with a verb (\"Returns ...\"), any other with a noun phrase",
    );
}

/// Collector of functions whose comments do not begin with a verb in the third person.
struct Functions {
    path: String,
    found: Vec<String>,
}

impl Functions {
    fn check(&mut self, attributes: &[syn::Attribute], signature: &syn::Signature) {
        let is_test = attributes.iter().any(|attribute| attribute.path().is_ident("test"));
        let Some(first) = attributes.iter().find_map(doc_text).filter(|_| !is_test) else { return };
        let word = first.trim().split([' ', ',', '.']).next().unwrap_or_default();
        if !word.ends_with('s') || !word.starts_with(char::is_uppercase) {
            let line = signature.fn_token.span.start().line;
            self.found.push(format!("{}:{line} `{}`: {}", self.path, signature.ident, first.trim()));
        }
    }
}

fn doc_text(attribute: &syn::Attribute) -> Option<String> {
    let syn::Meta::NameValue(meta) = &attribute.meta else { return None };
    let syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(text), .. }) = &meta.value else { return None };
    meta.path.is_ident("doc").then(|| text.value())
}

impl<'ast> Visit<'ast> for Functions {
    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.check(&item.attrs, &item.sig);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.check(&item.attrs, &item.sig);
        visit::visit_impl_item_fn(self, item);
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        self.check(&item.attrs, &item.sig);
        visit::visit_trait_item_fn(self, item);
    }
}

#[test]
fn comments_of_functions_begin_with_a_verb() {
    let mut found = Vec::new();
    for source in everywhere(&["rs"]) {
        let mut functions = Functions { path: source.path.display().to_string(), found: Vec::new() };
        functions.visit_file(&source.parse());
        found.append(&mut functions.found);
    }
    expect_none(&found, "begin with a verb in the third person, for example \"Returns\" or \"Parses\"");
}

#[test]
fn limits_are_named_max_and_min() {
    let mut found = Vec::new();
    for source in everywhere(&["rs", "py"]) {
        for (number, line) in source.text.lines().enumerate() {
            let line = line.trim_start().trim_start_matches("pub ").trim_start_matches("const ");
            if ["MOST_", "LEAST_"].iter().any(|prefix| line.starts_with(prefix)) {
                found.push(format!("{}:{}: {line}", source.path.display(), number + 1));
            }
        }
    }
    expect_none(&found, "name limits MAX_ or MIN_, a noun and its unit");
}

#[test]
fn comments_fit_their_lines() {
    let mut found = Vec::new();
    for source in everywhere(&["rs"]) {
        for (number, line) in source.text.lines().enumerate() {
            let is_comment = line.trim_start().starts_with("//") && !line.contains("http");
            if is_comment && line.chars().count() > MAX_COMMENT_COLUMNS {
                found.push(format!("{}:{}", source.path.display(), number + 1));
            }
        }
    }
    expect_none(&found, &format!("comments have at most {MAX_COMMENT_COLUMNS} columns"));
}

/// Forms of examples introduced by a bare "as": a JSON value, a quotation, or a command-line value.
const EXAMPLES: [&str; 6] = [", as [[", ", as {", ", as \\\"", ", as agent:", ", as act:", ", as B="];

/// The test covers texts that callers and users read, in errors, help and comments.
#[test]
fn examples_are_named_as_examples() {
    let mut found = Vec::new();
    for source in everywhere(&["rs", "py"]) {
        if source.path.ends_with("tests/tests/tidy/words/mod.rs") {
            continue;
        }
        for (number, line) in source.text.lines().enumerate() {
            if EXAMPLES.iter().any(|example| line.contains(example)) {
                found.push(format!("{}:{}: {}", source.path.display(), number + 1, line.trim()));
            }
        }
    }
    expect_none(&found, "write \"for example\" or \"such as\" before an example, not \"as\"");
}
