//! Tests of the episodes that each caller sees in the list, and of the start page.

use serde_json::{Value, json};
use tandem::{settings::Layer, token::Token};
use tandem_tests::TestServer;
use tandem_tools_spec::EpisodeList;

const TOKEN: &str = "correct-horse-battery-staple";

fn ids(list: &Value) -> Vec<&str> {
    list["episodes"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|entry| entry["episode_id"].as_str())
        .collect()
}

/// Returns the status and the text of the response to a caller with this token.
fn asked(server: &TestServer, token: &str, path: &str) -> (u16, String) {
    let bearer = format!("Bearer {token}");
    let (status, _, bytes) = server.ask(
        "GET",
        path,
        &[("authorization", &bearer), ("accept", "text/html, application/json")],
        b"",
    );
    (status, String::from_utf8(bytes).expect("text"))
}

#[test]
fn the_list_has_every_episode_as_it_stands() {
    let server = TestServer::start();
    assert_eq!(server.get("/v1/episodes").ok(), json!({ "episodes": [] }));
    let first = server.episode("agentic");
    let body = json!({ "task": "move_house", "seed": 3, "protocol": "benchmark", "operators": "per_robot" });
    server.post("/v1/episodes", &body).ok();
    server.tool(&first, "wait", &json!({ "steps": 7 })).ok();
    let entry = |id: &str,
                 task: &str,
                 seed: u32,
                 protocol: &str,
                 operators: &str,
                 step: u32,
                 ended: Value| {
        json!({
            "episode_id": id, "task": task, "seed": seed, "protocol": protocol, "operators": operators, "step": step,
            "ended": ended,
        })
    };
    let house = entry("move_house-seed3", "move_house", 3, "benchmark", "per_robot", 0, Value::Null);
    let handover = |ended| entry(&first, "handover", 0, "agentic", "one", 307, ended);
    let expected = |ended| json!({ "episodes": [handover(ended), house] });
    assert_eq!(server.get("/v1/episodes").ok(), expected(Value::Null));
    server.tool(&first, "finish", &json!({})).ok();
    let list = server.get("/v1/episodes").ok();
    assert_eq!(list, expected(json!("finished")));

    let read: EpisodeList =
        serde_json::from_value(list.clone()).expect("what the OpenAPI description is made of");
    assert_eq!(json!(read), list);
    let document = server.get("/v1/openapi.json").ok();
    let schema = &document["paths"]["/v1/episodes"]["get"]["responses"]["200"]["content"]["application/json"]
        ["schema"];
    let described = schema["properties"]["episodes"]["items"]["required"].as_array().map(Vec::len);
    assert_eq!(
        described,
        list["episodes"][0].as_object().map(|entry| entry.len() - 2),
        "all but null and the seed, which is not always told: {schema}"
    );

    server.delete(&format!("/v1/episodes/{first}")).ok();
    assert_eq!(ids(&server.get("/v1/episodes").ok()), ["move_house-seed3"]);
}

#[test]
fn who_has_a_token_sees_its_own_episodes() {
    let token = Some(Token::parse(TOKEN, "a test").expect("a token"));
    let server = TestServer::with(Layer { token, ..Layer::default() });
    let bearer = format!("Bearer {TOKEN}");
    let start = |fields: Value| {
        let mut body = json!({ "task": "handover", "seed": 0, "protocol": "benchmark" });
        body.as_object_mut().expect("an object").extend(fields.as_object().cloned().unwrap_or_default());
        server.post_with("/v1/episodes", &[("authorization", &bearer)], &body).ok()
    };
    let (own, team) = (start(json!({})), start(json!({ "seed": 1, "operators": "per_robot" })));
    let [own, team_id] = [&own, &team].map(|started| started["episode_id"].as_str().expect("an id"));
    let operator = team["operators"][1]["token"].as_str().expect("a token");

    let list = |token: &str| -> Value {
        serde_json::from_str(&asked(&server, token, "/v1/episodes").1).expect("JSON")
    };
    assert_eq!(ids(&list(TOKEN)), [own, team_id]);
    assert_eq!(ids(&list(operator)), [team_id], "the other episode is not an operator's to know of");
    let stranger = "nobody-has-this-token";
    for path in ["/v1/episodes", "/home/picture?task=handover"] {
        let (status, text) = asked(&server, stranger, path);
        assert!(status == 401 && !text.contains(own), "{path}: {text}");
    }
    // The start page is the same for everybody.
    let pages = [stranger, TOKEN, operator].map(|token| asked(&server, token, "/"));
    assert!(pages[0].0 == 200 && pages.iter().all(|page| *page == pages[0]), "{pages:?}");
    assert!(![own, team_id, operator, TOKEN].iter().any(|text| pages[0].1.contains(text)), "{pages:?}");
}

/// Language models read pages with programs that do not request HTML.
#[test]
fn who_asks_for_no_page_gets_a_few_lines() {
    let server = TestServer::start();
    for (path, says, most) in
        [("/", "GET  /v1/tools", 1500), ("/docs", "POST /v1/episodes/{episode_id}/tools/wait: Let all", 9000)]
    {
        for accept in [&[][..], &[("accept", "*/*")], &[("accept", "application/json")]] {
            let (status, headers, bytes) = server.ask("GET", path, accept, b"");
            let text = String::from_utf8(bytes).expect("text");
            assert!(status == 200 && text.contains(says), "{path}: {text}");
            assert!(text.len() < most && !text.contains("<"), "{path}: {} bytes", text.len());
            assert_eq!(headers["content-type"], "text/plain; charset=utf-8");
        }
    }
    // The path redirects to the description, and the client follows the redirect.
    assert_eq!(server.get("/openapi.json").ok(), server.get("/v1/openapi.json").ok());
}

#[test]
fn a_browser_finds_a_page_that_leads_on() {
    let server = TestServer::start();
    let (headers, page) = server.page("/");
    assert_eq!(headers["content-type"], "text/html; charset=utf-8");
    assert!(
        headers["content-security-policy"]
            .to_str()
            .is_ok_and(|policy| policy.starts_with("default-src 'none'"))
    );
    let named = |attribute: &str| -> Vec<String> {
        let values = page.split(attribute).skip(1).filter_map(|rest| rest.split('"').next());
        values.filter(|value| value.starts_with('/')).map(str::to_owned).collect()
    };
    let links = [named("href=\""), named("src=\"")].concat();
    for expected in ["/docs", "/home/page.css", "/home/page.js"] {
        assert!(links.iter().any(|link| link == expected), "{expected}: {links:?}");
    }
    links.iter().for_each(|link| drop(server.page(link)));
    assert!(
        page.contains(" data-starts") && !page.contains("http://") && !page.contains("https://"),
        "{page}"
    );
    assert!(server.page("/docs").1.contains("id=\"list_episodes\""));
}

#[test]
fn each_task_has_a_picture() {
    let server = TestServer::start();
    let (status, headers, picture) = server.ask("GET", "/home/picture?task=table_align", &[], b"");
    assert_eq!((status, &headers["content-type"]), (200, &"image/png".parse().unwrap()));
    assert!(picture.starts_with(b"\x89PNG"));
    let (status, _, problem) = server.ask("GET", "/home/picture?task=nope", &[], b"");
    assert!(status == 404 && String::from_utf8_lossy(&problem).contains("handover"), "{status}");
}
