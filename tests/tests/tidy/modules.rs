//! Modules of a crate without their tests, and the references between them.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Component, Path, PathBuf},
};

use syn::{Attribute, Item, Meta};

use super::{
    paths::{Mention, imports, mentions},
    sources::{Source, below},
};

/// A module's path from the crate's root, whose own path is empty.
pub type Name = Vec<String>;

/// A source file of a crate, without items compiled for tests only.
pub struct Module {
    pub name: Name,
    pub path: PathBuf,
    pub items: Vec<Item>,
}

/// A reference from one module to an item of another.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Arrow {
    pub from: Name,
    pub to: Name,
    /// File and line of the reference.
    pub place: String,
}

/// Returns the modules of the crate in the folder `member`.
pub fn modules(member: &str) -> Vec<Module> {
    read(&below(&format!("{member}/src"), &["rs"]), Path::new(member).join("src").as_path())
}

fn read(sources: &[Source], folder: &Path) -> Vec<Module> {
    let mut tests = BTreeSet::new();
    let mut found: Vec<Module> = Vec::new();
    for source in sources {
        let name = name(source.path.strip_prefix(folder).expect("below the crate's folder"));
        let (only_tests, items) =
            source.parse().items.into_iter().partition(|item| is_test(attributes(item)));
        let only_tests: Vec<Item> = only_tests;
        for item in only_tests {
            if let Item::Mod(module) = item {
                tests.insert([name.as_slice(), &[module.ident.to_string()]].concat());
            }
        }
        found.push(Module { name, path: source.path.clone(), items });
    }
    found.retain(|module| !tests.iter().any(|test: &Name| module.name.starts_with(test)));
    found
}

/// Returns the name of a file's module: `a::b` for `a/b.rs` and `a/b/mod.rs`, and the root for `lib.rs`.
fn name(path: &Path) -> Name {
    let whole = path.with_extension("");
    let parts = whole.components().filter_map(|part| match part {
        Component::Normal(part) => Some(part.to_string_lossy().into_owned()),
        _ => None,
    });
    let mut name: Name = parts.collect();
    if name.last().is_some_and(|last| last == "mod") || name == ["lib"] {
        name.pop();
    }
    name
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) => list.path.is_ident("cfg") && list.tokens.to_string() == "test",
        Meta::Path(_) | Meta::NameValue(_) => false,
    })
}

/// Returns the attributes of an item, for the kinds of items that may be compiled for tests only.
fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Mod(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Const(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        _ => &[],
    }
}

/// Returns every reference between modules, with re-exports resolved to the defining module.
pub fn arrows(modules: &[Module]) -> Vec<Arrow> {
    let map = Map::new(modules);
    let mut found = Vec::new();
    for module in modules {
        for Mention { path, line } in mentions(&module.name, &module.items) {
            let to = map.home(&path);
            if to != module.name {
                let place = format!("{}:{line}", module.path.display());
                found.push(Arrow { from: module.name.clone(), to, place });
            }
        }
    }
    found.sort();
    found.dedup_by(|one, other| (&one.from, &one.to) == (&other.from, &other.to));
    found
}

/// Names of all modules, and the names that each imports.
struct Map<'a> {
    names: BTreeSet<&'a Name>,
    imported: BTreeMap<(&'a Name, String), Name>,
}

/// Maximum length of a chain of re-exports, in case of a cycle.
const MAX_HOPS: usize = 8;

impl<'a> Map<'a> {
    fn new(modules: &'a [Module]) -> Map<'a> {
        let names: BTreeSet<&Name> = modules.iter().map(|module| &module.name).collect();
        let mut imported = BTreeMap::new();
        for module in modules {
            for (own, path) in imports(&module.name, &module.items) {
                // A path that begins with neither `crate` nor `super` starts from a child module or another
                // crate.
                let path = path.unwrap_or_else(|relative| [module.name.as_slice(), &relative].concat());
                imported.insert((&module.name, own), path);
            }
        }
        Map { names, imported }
    }

    /// Returns the module that defines the item at `path`.
    fn home(&self, path: &[String]) -> Name {
        let (mut at, mut rest) = (Name::new(), path.to_vec());
        let mut hops = 0;
        while !rest.is_empty() {
            let next = rest.remove(0);
            let child = [at.as_slice(), std::slice::from_ref(&next)].concat();
            if self.names.contains(&child) {
                at = child;
            } else if let Some(target) = self.imported.get(&(&at, next)).filter(|_| hops < MAX_HOPS) {
                hops += 1;
                rest.splice(0..0, target.iter().cloned());
                at = Name::new();
            } else {
                break;
            }
        }
        at
    }
}

/// Builds the modules of a crate from texts, to test the checks of invariants.
pub fn made_of(files: &[(&str, &str)]) -> Vec<Module> {
    let sources: Vec<Source> = files
        .iter()
        .map(|(path, text)| Source { path: Path::new("x").join(path), text: (*text).into() })
        .collect();
    read(&sources, Path::new("x"))
}

#[test]
fn arrows_lead_to_where_things_stand() {
    let check = |files: &[(&str, &str)], expected: &[(&str, &str)]| {
        let modules = made_of(files);
        let found: Vec<(String, String)> =
            arrows(&modules).iter().map(|arrow| (arrow.from.join("::"), arrow.to.join("::"))).collect();
        let found: Vec<(&str, &str)> = found.iter().map(|(from, to)| (from.as_str(), to.as_str())).collect();
        assert_eq!(found, expected, "{files:?}");
    };
    let (b, none) = (("b.rs", "pub struct B;"), ("lib.rs", ""));
    check(&[none, ("a.rs", "use crate::b::B;"), b], &[("a", "b")]);
    check(&[none, ("a.rs", "use crate::{b::{self, B as C}, d};"), b], &[("a", ""), ("a", "b")]);
    check(&[none, ("a.rs", "fn f(b: &super::b::B) {}"), b], &[("a", "b")]);
    check(&[none, ("a.rs", "fn f() { drop(vec![crate::b::B]) }"), b], &[("a", "b")]);
    check(&[none, ("a.rs", "mod t { use super::super::b::B; }"), b], &[("a", "b")]);
    check(&[none, ("a/mod.rs", "mod c;"), ("a/c.rs", "use super::super::b::B;"), b], &[("a::c", "b")]);
    check(&[("lib.rs", "pub use b::B;"), ("a.rs", "use crate::B;"), b], &[("", "b"), ("a", "b")][1..]);
    check(
        &[("lib.rs", "pub use e::B;"), ("a.rs", "use crate::B;"), ("e.rs", "pub use crate::b::B;"), b],
        &[("a", "b"), ("e", "b")],
    );
    check(&[none, ("a.rs", "#[cfg(test)] mod tests { use crate::b::B; }"), b], &[]);
    check(&[none, ("a/mod.rs", "#[cfg(test)] mod t;"), ("a/t.rs", "use crate::b::B;"), b], &[]);
    check(&[none, ("a.rs", "use std::fmt; use other::b::B;"), b], &[]);
}
