//! Tests of the order of a crate's modules: each module imports only from earlier modules.

use std::collections::BTreeSet;

use super::{
    modules::{Arrow, arrows, made_of, modules},
    sources::expect_none,
};

/// Top-level modules of each crate, by row. A module may refer only to modules of earlier rows.
const ORDER: &[(&str, &[&[&str]])] = &[
    (
        "sim",
        &[
            &["units", "sides", "plane", "random", "srgb", "mass", "dynamics", "owner", "user_file"],
            &["error"],
            &["assets"],
            &["mjcf"],
            &["mechanism"],
            &["body"],
            &["estimate", "locomotion"],
            &["robot"],
            &["world"],
            &["render"],
        ],
    ),
    (
        "episodes",
        &[
            &["output", "locks", "html", "fingerprint", "scoring", "convert"],
            &["error", "conditions", "result_file"],
            &["tasks"],
            &["variation", "words", "protocol"],
            &["stress"],
            &["spec"],
            &["commands"],
            &["observation", "rows"],
            &["describe", "recording"],
            &["live", "pages"],
            &["instructions", "session"],
            &["players", "replay"],
        ],
    ),
    (
        "episodes/evaluation",
        &[
            &["batch", "results", "robot_check", "statistics", "task_check", "task_draft"],
            &["policies", "reports"],
            &["evaluation"],
        ],
    ),
    (
        "tests/bench",
        &[
            &["error", "report", "seeds", "spread"],
            &["env", "falls", "ik", "physics", "pictures", "single", "teams"],
            &["controllers"],
        ],
    ),
    (
        "gateway/policies",
        &[
            &["error", "poses", "values"],
            &["client", "columns"],
            &["kept_client", "named_columns"],
            &["map"],
            &["request"],
            &["action"],
            &["policy_session", "trial"],
        ],
    ),
    (
        "gateway",
        &[
            &["token", "metrics", "live_view"],
            &["settings"],
            &["hosting"],
            &["http"],
            &["drivers"],
            &["commands"],
            &["cli"],
            &["main"],
        ],
    ),
];

fn misplaced(rows: &[&[&str]], names: &BTreeSet<String>, arrows: &[Arrow]) -> Vec<String> {
    let row = |name: &str| rows.iter().position(|row| row.contains(&name));
    let nowhere = names
        .iter()
        .filter(|name| row(name).is_none())
        .map(|name| format!("{name} has no place in the order; give it one in tests/tests/tidy/order.rs"));
    let backward = arrows.iter().filter_map(|arrow| {
        let (from, to) = (arrow.from.first()?, arrow.to.first()?);
        (from != to && row(to)? >= row(from)?).then(|| format!("{from} -> {to} at {}", arrow.place))
    });
    nowhere.chain(backward).collect()
}

#[test]
fn modules_import_along_the_order() {
    for (member, rows) in ORDER {
        let modules = modules(member);
        let names = modules.iter().filter_map(|module| module.name.first().cloned()).collect();
        let found = misplaced(rows, &names, &arrows(&modules));
        let order: Vec<String> = rows.iter().map(|row| row.join(", ")).collect();
        expect_none(&found, &format!("{member} is built in the order {}", order.join(" <- ")));
    }
}

#[test]
fn what_is_out_of_order_is_found() {
    let check = |files: &[(&str, &str)], expected: usize| {
        let modules = made_of(files);
        let names = modules.iter().filter_map(|module| module.name.first().cloned()).collect();
        let found = misplaced(&[&["a"], &["b", "c"]], &names, &arrows(&modules));
        assert_eq!(found.len(), expected, "{files:?}: {found:?}");
    };
    check(&[("a.rs", ""), ("b/mod.rs", ""), ("b/d.rs", "use crate::a::A;")], 0);
    check(&[("a.rs", "use crate::b::d::D;"), ("b/mod.rs", ""), ("b/d.rs", "")], 1);
    check(&[("b.rs", "use crate::c::C;"), ("c.rs", "")], 1);
    check(&[("d.rs", "")], 1);
}
