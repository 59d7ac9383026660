//! Types of the contract as Python dataclasses.

use std::collections::BTreeSet;

use serde_json::{Map, Value};
use tandem_tools_spec::TypedTool;

use super::text::{Lines, docstring};
use super::types::{Parameter, parameters, python_name, reference, reply_type};
use super::{OF_DEPTH, OF_OBSERVE, OF_PLANS, OF_RESULT, OF_START, described, is_method};

/// Base class of all replies, which parses them.
const BASE: &str = "Reply";

/// The types of the contract, grouped by the types that contain them.
pub struct Contract<'a> {
    types: &'a Map<String, Value>,
    arguments: BTreeSet<String>,
    /// Replies to commands.
    commands: BTreeSet<String>,
    /// Replies to plans and walks.
    plans: BTreeSet<String>,
    /// Points and surfaces.
    depth: BTreeSet<String>,
    /// Replies of other tools of an episode.
    replies: BTreeSet<String>,
    /// Results of episodes.
    result: BTreeSet<String>,
    /// Replies of starts and lists of tasks.
    start: BTreeSet<String>,
}

impl<'a> Contract<'a> {
    pub fn of(types: &'a Map<String, Value>, tools: &[TypedTool]) -> Contract<'a> {
        let contract = Contract {
            types,
            arguments: BTreeSet::new(),
            commands: BTreeSet::new(),
            plans: BTreeSet::new(),
            depth: BTreeSet::new(),
            replies: BTreeSet::new(),
            result: BTreeSet::new(),
            start: BTreeSet::new(),
        };
        let on_episode = || tools.iter().filter(|tool| is_method(tool));
        // All commands have the same reply. Every other tool has a separate one.
        let is_common = |reply: &str| on_episode().filter(|tool| tool.reply == reply).count() > 1;
        let all_of = |names: Vec<&str>, but: &[&BTreeSet<String>]| -> BTreeSet<String> {
            let all = names.into_iter().flat_map(|name| contract.reached_from(name));
            all.filter(|name| !but.iter().any(|known| known.contains(name))).collect()
        };
        let arguments = on_episode().flat_map(|tool| contract.reached(&tool.arguments)).collect();
        let (common, own): (Vec<&str>, Vec<&str>) =
            on_episode().map(|tool| tool.reply.as_str()).partition(|reply| is_common(reply));
        let commands = all_of(common.into_iter().filter(|reply| *reply != OF_PLANS).collect(), &[]);
        let plans = all_of(vec![OF_PLANS], &[&commands]);
        let depth = all_of(OF_DEPTH.to_vec(), &[&commands, &plans]);
        let own = own.into_iter().filter(|reply| *reply != OF_RESULT);
        let replies = all_of(own.chain(OF_OBSERVE).collect(), &[&commands, &plans, &depth]);
        let told = [&commands, &plans, &depth, &replies];
        let result = all_of(vec![OF_RESULT], &told);
        let start = all_of(OF_START.to_vec(), &[&told[..], &[&result]].concat());
        Contract { arguments, commands, plans, depth, replies, result, start, ..contract }
    }

    /// Returns the classes and enumerations to which a schema refers directly.
    pub fn named_in(&self, schema: &Value) -> Vec<String> {
        let mut found = Vec::new();
        references(schema, &mut found);
        found
    }

    /// Returns the names of all types that a schema contains, directly or indirectly.
    fn reached(&self, schema: &Value) -> BTreeSet<String> {
        let mut reached = BTreeSet::new();
        let mut next = self.named_in(schema);
        while let Some(name) = next.pop() {
            next.extend(self.named_in(&self.types[&name]).into_iter().filter(|name| !reached.contains(name)));
            reached.insert(name);
        }
        reached
    }

    fn reached_from(&self, name: &str) -> BTreeSet<String> {
        let mut reached = self.reached(&self.types[name]);
        reached.insert(name.into());
        reached
    }

    fn is_class(&self, name: &str) -> bool {
        self.types[name]["properties"].is_object()
    }

    /// Returns true for an enumeration that also occurs in replies; the modules of replies define it.
    pub fn is_replied(&self, name: &str) -> bool {
        !self.is_class(name)
            && [&self.commands, &self.depth, &self.replies, &self.result]
                .iter()
                .any(|names| names.contains(name))
    }

    /// Returns the Python type of a name that is neither a class nor an enumeration, for example the type of
    /// numbers by joint.
    fn plain(&self, name: &str) -> Option<String> {
        let schema = &self.types[name];
        let named = self.is_class(name) || choices(schema).is_some();
        (!named).then(|| reply_type(schema, &|name| self.plain(name)))
    }

    /// Returns the module of the tools' arguments.
    pub fn arguments(&self) -> String {
        let mut lines = head("Arguments of tools.");
        lines.add(0, "from collections.abc import Mapping, Sequence");
        lines.add(0, "from dataclasses import dataclass, fields, is_dataclass");
        let defines = |name: &String| choices(&self.types[name]).is_some() && !self.is_replied(name);
        let literal = if self.arguments.iter().any(defines) { "Literal, " } else { "" };
        lines.add(0, &format!("from typing import Any, {literal}TypeAlias, cast\n"));
        lines.add(0, "import numpy as np");
        lines.add(0, "from numpy.typing import NDArray\n");
        let (replied, own): (Vec<&String>, Vec<&String>) =
            self.arguments.iter().filter(|name| !self.is_class(name)).partition(|name| self.is_replied(name));
        if !replied.is_empty() {
            self.import(&mut lines, replied.into_iter().cloned().collect());
            lines.add(0, "");
        }
        lines.add(0, include_str!("plain.py").trim_end());
        own.into_iter().for_each(|name| self.choices(&mut lines, name));
        for name in self.arguments.iter().filter(|name| self.is_class(name)) {
            self.argument_class(&mut lines, name);
        }
        lines.text()
    }

    fn argument_class(&self, lines: &mut Lines, name: &str) {
        let schema = &self.types[name];
        lines.add(0, "\n\n@dataclass(frozen=True)");
        lines.add(0, &format!("class {name}:"));
        docstring(lines, 1, &described(schema), &[]);
        let fields: Vec<Parameter> = parameters(schema);
        for Parameter { name, kind, about, required, .. } in &fields {
            lines.add(0, "");
            let default = if *required { "" } else { " = None" };
            lines.add(1, &format!("{name}: {kind}{default}"));
            docstring(lines, 1, about, &[]);
        }
    }

    /// Returns the module of the replies to commands.
    pub fn commands(&self) -> String {
        self.reply_module("Replies to commands.", &self.commands)
    }

    /// Returns the module of the replies to plans and walks.
    pub fn plans(&self) -> String {
        self.reply_module("Replies to plans and walks.", &self.plans)
    }

    /// Returns the module of measured points and surfaces.
    pub fn depth(&self) -> String {
        self.reply_module("Replies to query_depth.", &self.depth)
    }

    /// Returns the module of the replies of an episode's other tools.
    pub fn replies(&self) -> String {
        self.reply_module("Replies to tools that are no commands.", &self.replies)
    }

    /// Returns the module of an episode's result.
    pub fn result(&self) -> String {
        self.reply_module("Results of episodes.", &self.result)
    }

    /// Returns the module of the replies to starts and to lists of tasks.
    pub fn start(&self) -> String {
        self.reply_module("Replies to a start, and lists of tasks.", &self.start)
    }

    fn reply_module(&self, about: &str, names: &BTreeSet<String>) -> String {
        let mut lines = head(about);
        let mut types = Lines::default();
        self.reply_types(&mut types, names);
        let types = types.text();
        let used = |name: &&str| types.contains(*name);
        let dataclasses: Vec<&str> = ["dataclass", "field("].into_iter().filter(used).collect();
        lines.add(0, &format!("from dataclasses import {}", dataclasses.join(", ").replace('(', "")));
        let typing: Vec<&str> = ["Any", "Literal", "TypeAlias"].into_iter().filter(used).collect();
        if !typing.is_empty() {
            lines.add(0, &format!("from typing import {}", typing.join(", ")));
        }
        lines.add(0, "");
        let named = names.iter().flat_map(|name| self.named_in(&self.types[name]));
        let elsewhere = named.filter(|name| !names.contains(name) && self.plain(name).is_none());
        self.import(&mut lines, elsewhere.chain([BASE.into()]).collect());
        lines.add(0, types.trim_end());
        lines.text()
    }

    /// Imports the types of replies from their modules.
    pub fn import(&self, lines: &mut Lines, names: Vec<String>) {
        for (module, own) in [
            ("commands", &self.commands),
            ("depth", &self.depth),
            ("plans", &self.plans),
            ("reading", &BTreeSet::from([BASE.to_owned()])),
            ("replies", &self.replies),
            ("result", &self.result),
        ] {
            lines.import(module, names.iter().filter(|name| own.contains(*name)).cloned());
        }
    }

    fn reply_types(&self, lines: &mut Lines, names: &BTreeSet<String>) {
        names.iter().for_each(|name| self.choices(lines, name));
        for name in names.iter().filter(|name| self.is_class(name)) {
            self.reply_class(lines, name);
        }
    }

    /// Returns the name of an enumeration of texts; `None` for another type.
    fn choices(&self, lines: &mut Lines, name: &str) {
        let Some(values) = choices(&self.types[name]) else { return };
        lines.add(0, "");
        lines.add(0, &format!("{name}: TypeAlias = Literal["));
        values.iter().for_each(|value| lines.add(1, &format!("\"{value}\",")));
        lines.add(0, "]");
        let text = match name {
            // Schemas contain only these names, so that lists of tools are short.
            "Color" => "Colour of a surface.".to_owned(),
            "PoseFrame" => "Frame of points and poses; the briefing describes each.".to_owned(),
            _ => described(&self.types[name]),
        };
        docstring(lines, 0, &text, &[]);
    }

    fn reply_class(&self, lines: &mut Lines, name: &str) {
        let schema = &self.types[name];
        let required: Vec<&str> =
            schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        lines.add(0, "\n\n@dataclass(frozen=True, kw_only=True)");
        lines.add(0, &format!("class {name}({BASE}):"));
        docstring(lines, 1, &described(schema), &[]);
        for (wire, field) in schema["properties"].as_object().into_iter().flatten() {
            let mut kind = reply_type(field, &|name| self.plain(name));
            let default = match (required.contains(&wire.as_str()), field["type"].as_str()) {
                (true, _) => String::new(),
                (false, Some("array")) => " = ()".into(),
                (false, Some("object")) => format!(" = field(default_factory={kind})"),
                (false, _) => {
                    if !kind.ends_with("| None") {
                        kind.push_str(" | None");
                    }
                    " = None".into()
                }
            };
            lines.add(0, "");
            lines.add(1, &format!("{}: {kind}{default}", python_name(wire)));
            docstring(lines, 1, &described(field), &[]);
        }
    }
}

fn head(about: &str) -> Lines {
    let mut lines = Lines::default();
    lines.head(about);
    lines
}

/// Returns the texts of an enumeration.
fn choices(schema: &Value) -> Option<Vec<String>> {
    let text = |value: &Value| value.as_str().map(str::to_owned);
    if let Some(values) = schema["enum"].as_array() {
        return values.iter().map(text).collect();
    }
    schema["oneOf"].as_array()?.iter().map(|choice| text(&choice["const"])).collect()
}

fn references(schema: &Value, found: &mut Vec<String>) {
    if let Some(name) = reference(schema) {
        found.push(name.into());
    }
    match schema {
        Value::Array(items) => items.iter().for_each(|item| references(item, found)),
        Value::Object(object) => object.values().for_each(|value| references(value, found)),
        _ => {}
    }
}
