//! Tests of request bodies and of server files in the documents: a server accepts them.

use std::fs;

use serde_json::{Value, json};
use tandem::settings::{Layer, Settings};
use tandem_tests::TestServer;

use super::pages::{Block, Page, pages};

/// Returns the blocks in all pages whose purpose begins with `purpose`, each with the rest of its purpose.
fn json_blocks(purpose: &str) -> Vec<(Page, Block, String)> {
    let mut found = Vec::new();
    for page in pages() {
        for block in page.blocks() {
            let rest = block.purpose.strip_prefix(purpose).map(str::to_owned);
            if let (Some(rest), "json") = (rest, block.language.as_str()) {
                found.push((Page { path: page.path.clone(), text: String::new() }, block, rest));
            }
        }
    }
    assert!(!found.is_empty(), "no page shows a block json,{purpose}");
    found
}

fn parsed(block: &Block) -> Value {
    serde_json::from_str(&block.text).expect("a block that parses, which another test sees to")
}

#[test]
fn tools_accept_the_bodies_that_pages_show() {
    let server = TestServer::start();
    for (page, block, tool) in json_blocks("tool=") {
        let id = server.episode("agentic");
        let answer = server.tool(&id, &tool, &parsed(&block));
        assert_eq!(answer.status, 200, "{}: {answer:?}", page.at(block.line));
        server.delete(&format!("/v1/episodes/{id}"));
    }
    for (page, block, _) in json_blocks("start") {
        let answer = server.post("/v1/episodes", &parsed(&block));
        assert_eq!(answer.status, 201, "{}: {answer:?}", page.at(block.line));
    }
}

/// Returns the bodies of a script's curl calls to a tool.
fn sent_to<'a>(tool: &str, script: &'a str) -> Vec<&'a str> {
    let route = format!("/tools/{tool} ");
    let calls = script.split(route.as_str()).skip(1);
    calls.filter_map(|rest| rest.split_once("-d '")?.1.split('\'').next()).collect()
}

/// A motion that takes half a second is complete for the reader.
#[test]
fn hands_that_pages_move_arrive() {
    let server = TestServer::start();
    let mut bodies: Vec<(String, Value)> = json_blocks("tool=move_wrists")
        .iter()
        .map(|(page, block, _)| (page.at(block.line), parsed(block)))
        .collect();
    for page in pages() {
        for block in page.blocks().iter().filter(|block| block.language == "sh") {
            let sent = sent_to("move_wrists", &block.text).into_iter();
            bodies.extend(sent.map(|body| (page.at(block.line), serde_json::from_str(body).expect("JSON"))));
        }
    }
    assert!(bodies.len() > 2, "{bodies:?}");
    for (place, body) in bodies {
        let id = server.episode("agentic");
        let reply = server.tool(&id, "move_wrists", &body).ok();
        for (asked, report) in
            body["robots"].as_array().into_iter().flatten().zip(reply["robots"].as_array().expect("robots"))
        {
            for side in
                ["left", "right"].into_iter().filter(|side| asked.get(format!("{side}_position_m")).is_some())
            {
                assert_eq!(report[side]["state"], "arrived", "{place}: {report:#}");
            }
        }
        server.delete(&format!("/v1/episodes/{id}"));
    }
}

#[test]
fn a_refusal_that_pages_show_is_the_one_that_comes() {
    let server = TestServer::start();
    let refused = server.post("/v1/episodes", &json!({ "task": "handove", "seed": 0 })).body;
    let shown = pages()
        .iter()
        .flat_map(Page::blocks)
        .any(|block| block.language == "json" && block.purpose.is_empty() && parsed(&block) == refused);
    assert!(shown, "no page shows {refused:#}");
}

#[test]
fn instructions_that_pages_show_are_read() {
    for (page, block, _) in json_blocks("instructions") {
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        fs::write(file.path(), &block.text).expect("a temporary file");
        let flags = Layer { instructions: Some(file.path().into()), ..Layer::default() };
        let read = Settings::resolve(flags, None);
        assert!(read.is_ok(), "{}: {:?}", page.at(block.line), read.err());
    }
}
