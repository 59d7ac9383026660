//! A test that a crate's modules have no circular dependencies, at any level of the tree.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    crates::members,
    modules::{Arrow, Name, arrows, made_of, modules},
    sources::expect_none,
};

/// Dependencies between the children of one module: from, to, and the first place with such a dependency.
type Siblings<'a> = BTreeMap<(&'a str, &'a str), &'a str>;

/// Groups dependencies by the common parent module. Each child includes all modules below it, since a file
/// and its folder belong together.
fn levels(arrows: &[Arrow]) -> BTreeMap<&[String], Siblings<'_>> {
    let mut levels: BTreeMap<&[String], Siblings> = BTreeMap::new();
    for Arrow { from, to, place } in arrows {
        let shared = from.iter().zip(to).take_while(|(one, other)| one == other).count();
        if let (Some(one), Some(other)) = (from.get(shared), to.get(shared)) {
            levels.entry(&from[..shared]).or_default().entry((one, other)).or_insert(place);
        }
    }
    levels
}

/// Returns every dependency that is part of a cycle.
fn circles(arrows: &[Arrow]) -> Vec<String> {
    let mut found = Vec::new();
    for (level, siblings) in levels(arrows) {
        for ((from, to), place) in &siblings {
            if reaches(&siblings, to, from) {
                let parent: Name = [&["crate".into()], level].concat();
                found.push(format!("{}: {from} -> {to} at {place}", parent.join("::")));
            }
        }
    }
    found
}

fn reaches(siblings: &Siblings, from: &str, to: &str) -> bool {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(at) = open.pop() {
        if at == to {
            return true;
        }
        if seen.insert(at) {
            open.extend(siblings.keys().filter(|(one, _)| *one == at).map(|(_, other)| *other));
        }
    }
    false
}

#[test]
fn no_modules_form_a_circle() {
    let found: Vec<String> = members()
        .flat_map(|member| {
            circles(&arrows(&modules(member))).into_iter().map(move |circle| format!("{member}, {circle}"))
        })
        .collect();
    let rule = "modules form no circle; of each circle below, break one arrow: move what both sides need into a module \
                under both, or hand it over as an argument";
    expect_none(&found, rule);
}

#[test]
fn circles_are_found_on_every_level() {
    let check = |files: &[(&str, &str)], expected: usize| {
        let found = circles(&arrows(&made_of(files)));
        assert_eq!(found.len(), expected, "{files:?}: {found:?}");
    };
    check(&[("a.rs", "use crate::b::B;"), ("b.rs", "")], 0);
    check(&[("a.rs", "use crate::b::B;"), ("b.rs", "use crate::a::A;")], 2);
    check(&[("a.rs", "use crate::b::B;"), ("b.rs", "use crate::c::C;"), ("c.rs", "use crate::a::A;")], 3);
    check(&[("a/mod.rs", ""), ("a/b.rs", "use super::c::C;"), ("a/c.rs", "use super::b::B;")], 2);
    check(&[("a/mod.rs", ""), ("a/b.rs", "use crate::c::C;"), ("c.rs", "use crate::a::b::B;")], 2);
    check(&[("a/mod.rs", "use b::B;"), ("a/b.rs", "use super::A;")], 0);
}
