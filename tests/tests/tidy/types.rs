//! A test that the name of a type is unique within its crate.

use std::collections::BTreeMap;

use syn::{
    Ident, ItemEnum, ItemStruct, ItemTrait, ItemType, ItemUnion,
    visit::{self, Visit},
};

use super::{
    crates::members,
    sources::{Source, below, expect_none, files},
};

/// Names and lines of all types that a file defines, except for associated types of traits.
#[derive(Default)]
struct Types {
    found: Vec<(String, usize)>,
}

impl Types {
    fn add(&mut self, name: &Ident) {
        self.found.push((name.to_string(), name.span().start().line));
    }
}

impl<'ast> Visit<'ast> for Types {
    fn visit_item_struct(&mut self, item: &'ast ItemStruct) {
        self.add(&item.ident);
        visit::visit_item_struct(self, item);
    }

    fn visit_item_enum(&mut self, item: &'ast ItemEnum) {
        self.add(&item.ident);
        visit::visit_item_enum(self, item);
    }

    fn visit_item_union(&mut self, item: &'ast ItemUnion) {
        self.add(&item.ident);
        visit::visit_item_union(self, item);
    }

    fn visit_item_trait(&mut self, item: &'ast ItemTrait) {
        self.add(&item.ident);
        visit::visit_item_trait(self, item);
    }

    fn visit_item_type(&mut self, item: &'ast ItemType) {
        self.add(&item.ident);
        visit::visit_item_type(self, item);
    }
}

/// Returns the names that several types of a crate share, with their locations.
fn repeated(sources: &[Source]) -> Vec<String> {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for source in sources {
        let mut types = Types::default();
        types.visit_file(&source.parse());
        for (name, line) in types.found {
            places.entry(name).or_default().push(format!("{}:{line}", source.path.display()));
        }
    }
    let repeated = places.into_iter().filter(|(_, places)| places.len() > 1);
    repeated.map(|(name, places)| format!("{name}: {}", places.join(", "))).collect()
}

/// Returns the source folders of all crates, and the folder of each test program.
fn crate_folders() -> Vec<String> {
    let mut folders = Vec::new();
    for member in members() {
        folders.push(format!("{member}/src"));
        let programs = files(member).into_iter().filter(|path| path.ends_with("main.rs"));
        let programs = programs.filter_map(|path| Some(path.parent()?.to_string_lossy().into_owned()));
        folders.extend(programs.filter(|folder| folder.starts_with(&format!("{member}/tests/"))));
    }
    folders
}

#[test]
fn no_two_types_of_a_crate_have_one_name() {
    let folders = crate_folders();
    assert!(folders.iter().any(|folder| folder == "tests/tests/tidy"), "{folders:?}");
    let found: Vec<String> = folders.iter().flat_map(|folder| repeated(&below(folder, &["rs"]))).collect();
    let rule = "a name stands for one type of a crate; find for each of these the word that says which it is";
    expect_none(&found, rule);
}

#[test]
fn repeated_names_are_found_wherever_they_stand() {
    let check = |texts: &[&str], expected: &[&str]| {
        let source = |text: &&str| Source { path: "x.rs".into(), text: (*text).into() };
        let found = repeated(&texts.iter().map(source).collect::<Vec<_>>());
        let names: Vec<&str> = found.iter().filter_map(|place| place.split(':').next()).collect();
        assert_eq!(names, expected, "{texts:?}");
    };
    check(&["struct A;", "enum B {}"], &[]);
    check(&["struct A;", "enum A {}"], &["A"]);
    check(&["trait A {} mod b { type A = u8; }"], &["A"]);
    check(&["struct A;", "#[cfg(test)] mod tests { fn f() { union A { b: u8 } } }"], &["A"]);
    check(&["trait A { type Item; }", "impl A for B { type Item = u8; }", "struct Item;"], &[]);
}
