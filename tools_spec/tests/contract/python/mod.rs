//! The tools as typed Python in `gateway/python/tandem/contract`: classes of arguments and replies, and a
//! method for each tool.
//!
//! `UPDATE_EXPECT=1 cargo test --workspace --release --test contract python` rewrites them.

mod classes;
mod text;
mod types;

use std::{env, fs, path::Path};

use serde_json::Value;
use tandem_tools_spec::{TypedTool, TypedTools, typed_tools};

use classes::Contract;
use text::{Lines, docstring};
use types::Parameter;

/// The package implements this method itself, because it returns images as arrays, which JSON Schema cannot
/// express.
const OBSERVE: &str = "observe";
/// Types in the reply to `observe`, besides images.
const OF_OBSERVE: [&str; 2] = ["RobotState", "CameraCalibration"];
/// Replies to plans and walks.
const OF_PLANS: &str = "PlanReply";
/// Points and surfaces.
const OF_DEPTH: [&str; 1] = ["DepthReply"];
/// Results of episodes.
const OF_RESULT: &str = "ResultReply";
/// Lists of tasks, and the parts of a start that do not depend on where the episode runs.
const OF_START: [&str; 2] = ["Briefing", "TaskList"];

#[test]
fn the_python_package_has_every_tool() {
    let TypedTools { tools, types } = typed_tools();
    let contract = Contract::of(&types, &tools);
    let modules = [
        ("arguments", contract.arguments()),
        ("commands", contract.commands()),
        ("plans", contract.plans()),
        ("depth", contract.depth()),
        ("replies", contract.replies()),
        ("result", contract.result()),
        ("start", contract.start()),
        ("tools", methods(&contract, &tools)),
    ];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../gateway/python/tandem/contract");
    for (name, text) in modules {
        let path = folder.join(format!("{name}.py"));
        if env::var_os("UPDATE_EXPECT").is_some() {
            fs::write(&path, &text).expect("the file can be written");
        }
        let kept = fs::read_to_string(&path).unwrap_or_default();
        let differs = kept.lines().zip(text.lines()).find(|(kept, now)| kept != now);
        let path = path.display();
        assert!(kept == text, "{path} differs at {differs:?}; write it anew with UPDATE_EXPECT=1");
    }
}

/// Returns a class with a method for each tool of an episode that a policy for all robots may call.
fn methods(contract: &Contract, tools: &[TypedTool]) -> String {
    let offered: Vec<&TypedTool> = tools.iter().filter(|tool| is_method(tool)).collect();
    let parameters = |tool: &TypedTool| types::parameters(&tool.arguments);
    let mut lines = Lines::default();
    lines.head("Every tool of an episode as a method.");
    lines.add(0, "from abc import ABC, abstractmethod");
    lines.add(0, "from collections.abc import Mapping, Sequence");
    lines.add(0, "from typing import Any\n");
    let of_arguments = offered.iter().flat_map(|tool| contract.named_in(&tool.arguments));
    let (replied, own): (Vec<String>, Vec<String>) = of_arguments.partition(|name| contract.is_replied(name));
    lines.import("arguments", own.into_iter().chain(["Json".into(), "Numbers".into(), "plain".into()]));
    contract.import(&mut lines, offered.iter().map(|tool| tool.reply.clone()).chain(replied).collect());
    lines.add(0, "\n");
    lines.add(0, "class Tools(ABC):");
    lines.add(1, "\"\"\"What can be asked of an episode, wherever it runs.\"\"\"\n");
    lines.add(1, "@abstractmethod");
    lines.add(1, "def call(self, tool: str, arguments: Mapping[str, Json]) -> Any:");
    lines.add(2, "\"\"\"Calls the tool of this name, and returns its reply as JSON has it.\"\"\"");
    for tool in offered {
        method(&mut lines, tool, &parameters(tool));
    }
    lines.text()
}

fn is_method(tool: &TypedTool) -> bool {
    tool.on_episode && !tool.for_operators && tool.name != OBSERVE
}

fn method(lines: &mut Lines, tool: &TypedTool, parameters: &[Parameter]) {
    let TypedTool { name, arguments, reply, .. } = tool;
    let required = parameters.iter().filter(|parameter| parameter.required);
    let optional = parameters.iter().filter(|parameter| !parameter.required);
    let mut signature: Vec<String> = vec!["self".into()];
    signature.extend(required.map(|parameter| format!("{}: {}", parameter.name, parameter.kind)));
    let optional: Vec<String> =
        optional.map(|parameter| format!("{}: {} = None", parameter.name, parameter.kind)).collect();
    if !optional.is_empty() {
        signature.push("*".into());
    }
    signature.extend(optional);
    lines.add(0, "");
    lines.add(1, &format!("def {name}("));
    signature.iter().for_each(|parameter| lines.add(2, &format!("{parameter},")));
    lines.add(1, &format!(") -> {reply}:"));
    let told: Vec<String> =
        parameters.iter().map(|parameter| format!("{}: {}", parameter.name, parameter.about)).collect();
    docstring(lines, 2, &described(arguments), &told);
    let given: Vec<String> =
        parameters.iter().map(|parameter| format!("\"{}\": {}", parameter.wire, parameter.name)).collect();
    match given.as_slice() {
        [] => lines.add(2, &format!("return {reply}.of(self.call(\"{name}\", {{}}))")),
        given => {
            lines.add(2, "arguments: dict[str, Any] = {");
            given.iter().for_each(|entry| lines.add(3, &format!("{entry},")));
            lines.add(2, "}");
            lines.add(2, &format!("return {reply}.of(self.call(\"{name}\", plain(arguments)))"));
        }
    }
}

/// Returns the description of a schema.
fn described(schema: &Value) -> String {
    schema["description"].as_str().unwrap_or_default().replace("Null:", "None:")
}
