//! Tests of the lengths of files and functions.

use std::path::Path;

use syn::{
    Block, File, ImplItemFn, ItemFn, Signature, TraitItemFn,
    visit::{self, Visit},
};

use super::sources::{everywhere, expect_none};

const LONGEST_FILE_LINES: usize = 500;
const MEDIAN_FILE_LINES: usize = 130;
const LONGEST_FUNCTION_LINES: usize = 60;

#[test]
fn no_source_file_is_too_long() {
    let too_long: Vec<String> = everywhere(&["rs", "py", "sh", "toml"])
        .into_iter()
        .map(|source| (source.path, source.text.lines().count()))
        .filter(|(_, lines)| *lines > LONGEST_FILE_LINES)
        .map(|(path, lines)| format!("{}: {lines}", path.display()))
        .collect();
    expect_none(&too_long, &format!("no file has more than {LONGEST_FILE_LINES} lines; split it by purpose"));
}

#[test]
fn most_source_files_are_short() {
    let mut lengths: Vec<(usize, String)> = everywhere(&["rs"])
        .into_iter()
        .map(|source| (source.text.lines().count(), source.path.display().to_string()))
        .collect();
    lengths.sort();
    let (median, _) = lengths[lengths.len() / 2];
    let longest: Vec<String> =
        lengths.iter().rev().take(10).map(|(lines, path)| format!("{path}: {lines}")).collect();
    assert!(
        median <= MEDIAN_FILE_LINES,
        "half of the Rust files have {median} lines or more, {MEDIAN_FILE_LINES} is the most; begin with the longest:\n  {}",
        longest.join("\n  ")
    );
}

/// Collector of functions longer than [`LONGEST_FUNCTION_LINES`], from `fn` to the closing brace.
struct Long<'a> {
    path: &'a Path,
    found: Vec<String>,
}

impl Long<'_> {
    fn measure(&mut self, signature: &Signature, body: &Block) {
        let first = signature.fn_token.span.start().line;
        let lines = body.brace_token.span.close().end().line + 1 - first;
        if lines > LONGEST_FUNCTION_LINES {
            self.found.push(format!("{}:{first} `{}`: {lines}", self.path.display(), signature.ident));
        }
    }
}

impl<'ast> Visit<'ast> for Long<'_> {
    fn visit_item_fn(&mut self, function: &'ast ItemFn) {
        self.measure(&function.sig, &function.block);
        visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast ImplItemFn) {
        self.measure(&function.sig, &function.block);
        visit::visit_impl_item_fn(self, function);
    }

    fn visit_trait_item_fn(&mut self, function: &'ast TraitItemFn) {
        if let Some(body) = &function.default {
            self.measure(&function.sig, body);
        }
        visit::visit_trait_item_fn(self, function);
    }
}

fn long(path: &Path, file: &File) -> Vec<String> {
    let mut long = Long { path, found: Vec::new() };
    long.visit_file(file);
    long.found
}

#[test]
fn no_function_is_too_long() {
    let found: Vec<String> =
        everywhere(&["rs"]).iter().flat_map(|source| long(&source.path, &source.parse())).collect();
    let rule = format!(
        "no function has more than {LONGEST_FUNCTION_LINES} lines; give its parts names of their own"
    );
    expect_none(&found, &rule);
}

#[test]
fn long_functions_are_found_wherever_they_stand() {
    let check = |lines: usize, expected: &[&str]| {
        let body = format!("{{{}}}", "\n".repeat(lines - 1));
        let text = format!("fn a() {body}\nimpl T {{ fn b() {body} }}\ntrait U {{ fn c() {body} fn d(); }}");
        let found = long(Path::new("x.rs"), &syn::parse_file(&text).expect("Rust"));
        let names: Vec<&str> = found.iter().filter_map(|place| place.split('`').nth(1)).collect();
        assert_eq!(names, expected, "functions of {lines} lines");
    };
    check(LONGEST_FUNCTION_LINES, &[]);
    check(LONGEST_FUNCTION_LINES + 1, &["a", "b", "c"]);
}
