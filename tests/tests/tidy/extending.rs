//! Tests of the instructions in `docs/src/extending.md`: an extension needs its own file and its line in
//! a list, and no other change in code.
//!
//! Any other hand-written list would contain the names of extensions, so no text in the code may equal an
//! extension's name.

use std::path::Path;

use proc_macro2::{TokenStream, TokenTree};
use syn::{
    Item, LitStr, Macro,
    visit::{self, Visit},
};

use super::{
    modules::modules,
    sources::{below, expect_none},
};

/// A kind of extension that the book describes.
struct Step {
    /// Name in the book.
    what: &'static str,
    /// Folder of the files.
    folder: &'static str,
    extension: &'static str,
    /// Text that identifies the files of this kind; the folder may contain other files.
    says: &'static str,
    /// Path prefixes of the code that may contain the names of extensions of this kind.
    may: &'static [&'static str],
}

const STEPS: &[Step] = &[
    Step {
        what: "task",
        folder: "episodes/tasks",
        extension: "toml",
        says: "[[phases]]",
        // Each expert plays one task. Handover is the task of the demo and of the example in the tool
        // interface.
        may: &[
            "episodes/src/tasks/",
            "episodes/src/players/experts/",
            "gateway/src/commands/demo.rs",
            "tools_spec/src/tools/start_episode.rs",
        ],
    },
    Step {
        what: "scene",
        folder: "sim/assets/scenes",
        extension: "xml",
        says: "<mujoco",
        may: &["episodes/src/tasks/", "episodes/evaluation/src/robot_check/", "tests/bench/src/"],
    },
    Step {
        what: "object",
        folder: "sim/assets/objects",
        extension: "xml",
        says: "<mujoco",
        // Tasks place objects, experts grasp them, and benches use them. The table of MJCF support has
        // elements and attributes with the same names.
        may: &[
            "episodes/src/tasks/",
            "episodes/src/players/experts/",
            "tests/bench/src/",
            "sim/src/mjcf/support/",
        ],
    },
    Step {
        what: "robot",
        folder: "sim/assets/robots",
        extension: "xml",
        says: "<mujoco",
        // The default robot.
        may: &["sim/src/assets.rs"],
    },
    Step {
        what: "tool",
        folder: "tools_spec/src/tools",
        extension: "rs",
        says: "impl Tool for",
        may: &["tools_spec/src/tools/"],
    },
    Step {
        what: "player",
        folder: "episodes/src/players",
        extension: "rs",
        says: "impl Player for",
        // The baseline in a report is the idle player, by its name in results.
        may: &["episodes/src/players/", "episodes/evaluation/src/results/mod.rs"],
    },
    Step {
        what: "renderer",
        folder: "sim/src/render",
        extension: "rs",
        says: "impl Renderer for",
        // In OpenAPI, "path" is a location of a parameter; in glTF, the moved property of a node.
        may: &["sim/src/render/", "tools_spec/src/schema/openapi.rs", "episodes/src/replay/export/gltf.rs"],
    },
];

const CRATES: [&str; 6] =
    ["tools_spec", "sim", "episodes", "episodes/evaluation", "gateway/policies", "gateway"];

/// Texts in a file with their lines, including those in macros.
#[derive(Default)]
struct Texts {
    found: Vec<(String, usize)>,
}

impl Texts {
    fn of(items: &[Item]) -> Vec<(String, usize)> {
        let mut texts = Texts::default();
        items.iter().for_each(|item| texts.visit_item(item));
        texts.found
    }

    fn add_tokens(&mut self, tokens: TokenStream) {
        for token in tokens {
            match token {
                TokenTree::Literal(literal) => {
                    let text = literal.to_string().trim_matches('"').to_owned();
                    self.found.push((text, literal.span().start().line));
                }
                TokenTree::Group(group) => self.add_tokens(group.stream()),
                TokenTree::Ident(_) | TokenTree::Punct(_) => {}
            }
        }
    }
}

impl<'ast> Visit<'ast> for Texts {
    fn visit_lit_str(&mut self, text: &'ast LitStr) {
        self.found.push((text.value(), text.span().start().line));
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        self.add_tokens(call.tokens.clone());
        visit::visit_macro(self, call);
    }
}

/// Returns the name of the file, or of its folder.
fn name(path: &Path) -> String {
    let parts = path.with_extension("");
    let last = parts.iter().rev().find(|part| *part != "mod" && *part != "robot").unwrap_or_default();
    last.to_string_lossy().into_owned()
}

#[test]
fn what_is_added_is_named_only_where_the_book_says() {
    let code: Vec<_> = CRATES.iter().flat_map(|member| modules(member)).collect();
    let code: Vec<_> = code.iter().map(|module| (&module.path, Texts::of(&module.items))).collect();
    let mut wrong = Vec::new();
    for step in STEPS {
        let files: Vec<_> = below(step.folder, &[step.extension])
            .into_iter()
            .filter(|file| file.text.contains(step.says))
            .collect();
        assert!(
            !files.is_empty(),
            "the book's step for a {} is about {}: nothing there",
            step.what,
            step.folder
        );
        for file in files {
            let name = name(&file.path);
            for (path, texts) in &code {
                if step.may.iter().any(|may| path.starts_with(may)) {
                    continue;
                }
                let named = texts.iter().filter(|(text, _)| *text == name);
                wrong.extend(
                    named.map(|(_, line)| format!("{} {name}: {}:{line}", step.what, path.display())),
                );
            }
        }
    }
    expect_none(
        &wrong,
        "these have to be told of what the book says can be added without them; read the list instead",
    );
}

#[test]
fn texts_are_found_in_macros_too() {
    let file = syn::parse_file("const A: &str = \"a\"; fn f() { g(vec![h(\"b\")]) }").expect("Rust");
    let texts: Vec<String> = Texts::of(&file.items).into_iter().map(|(text, _)| text).collect();
    assert_eq!(texts, ["a", "b"]);
}
