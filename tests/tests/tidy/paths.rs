//! Extraction of the paths in a Rust file.

use proc_macro2::{TokenStream, TokenTree};
use syn::{
    Item, ItemMod, ItemUse, Macro, Path, UseTree,
    visit::{self, Visit},
};

use super::modules::Name;

/// A path from the crate's root that a file refers to, with its line.
pub struct Mention {
    pub path: Name,
    pub line: usize,
}

/// Returns every path in `items`, in the module `name`, that begins with `crate`, `self` or `super`.
pub fn mentions(name: &[String], items: &[Item]) -> Vec<Mention> {
    let mut collector = Collector { at: name.to_vec(), found: Vec::new() };
    items.iter().for_each(|item| collector.visit_item(item));
    collector.found
}

/// Returns the imports of the module `name`: the local name, and the path from the root. A path that
/// begins with neither `crate` nor `super` is returned unchanged as an error.
pub fn imports(name: &[String], items: &[Item]) -> Vec<(String, Result<Name, Name>)> {
    let mut found = Vec::new();
    for item in items {
        if let Item::Use(item) = item {
            for (own, path) in leaves(&item.tree) {
                found.push((own, absolute(name, &path).ok_or(path)));
            }
        }
    }
    found
}

/// Returns every path of a `use`, with its local name.
fn leaves(tree: &UseTree) -> Vec<(String, Name)> {
    let mut found = Vec::new();
    walk(tree, &mut Name::new(), &mut found);
    found
}

fn walk(tree: &UseTree, before: &mut Name, found: &mut Vec<(String, Name)>) {
    let mut leaf = |ident: String, own: Option<String>| {
        let mut path = before.clone();
        if ident != "self" {
            path.push(ident);
        }
        let own = own.or_else(|| path.last().cloned()).unwrap_or_default();
        found.push((own, path));
    };
    match tree {
        UseTree::Name(name) => leaf(name.ident.to_string(), None),
        UseTree::Rename(rename) => leaf(rename.ident.to_string(), Some(rename.rename.to_string())),
        UseTree::Glob(_) => leaf("*".into(), None),
        UseTree::Path(path) => {
            before.push(path.ident.to_string());
            walk(&path.tree, before, found);
            before.pop();
        }
        UseTree::Group(group) => group.items.iter().for_each(|item| walk(item, before, found)),
    }
}

/// Resolves `path`, as written in the module `at`, from the crate's root.
fn absolute(at: &[String], path: &[String]) -> Option<Name> {
    let (first, rest) = path.split_first()?;
    match first.as_str() {
        "crate" => Some(rest.to_vec()),
        "self" => Some([at, rest].concat()),
        "super" => {
            let (_, parent) = at.split_last()?;
            match rest.first() {
                Some(next) if next == "super" => absolute(parent, rest),
                _ => Some([parent, rest].concat()),
            }
        }
        _ => None,
    }
}

struct Collector {
    at: Name,
    found: Vec<Mention>,
}

impl Collector {
    fn add(&mut self, path: &[String], line: usize) {
        self.found.extend(absolute(&self.at, path).map(|path| Mention { path, line }));
    }

    /// Collects paths from the tokens of a macro, which is not parsed.
    fn add_tokens(&mut self, tokens: TokenStream) {
        let (mut path, mut line, mut colons) = (Name::new(), 0, 0);
        for token in tokens {
            match token {
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.add(&std::mem::take(&mut path), line);
                        line = ident.span().start().line;
                    }
                    path.push(ident.to_string());
                    colons = 0;
                }
                TokenTree::Punct(punct) if punct.as_char() == ':' => colons += 1,
                TokenTree::Group(group) => {
                    self.add_tokens(group.stream());
                    colons = 0;
                }
                TokenTree::Punct(_) | TokenTree::Literal(_) => colons = 0,
            }
        }
        self.add(&path, line);
    }
}

impl<'ast> Visit<'ast> for Collector {
    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let line = item.use_token.span.start().line;
        for (_, path) in leaves(&item.tree) {
            self.add(&path, line);
        }
    }

    fn visit_path(&mut self, path: &'ast Path) {
        let names: Name = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        let line = path.segments.first().map_or(0, |first| first.ident.span().start().line);
        self.add(&names, line);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        self.add_tokens(call.tokens.clone());
    }

    fn visit_item_mod(&mut self, module: &'ast ItemMod) {
        self.at.push(module.ident.to_string());
        visit::visit_item_mod(self, module);
        self.at.pop();
    }
}
