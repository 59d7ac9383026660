//! `/`: links and the list of episodes, as a page without scripts.

use std::fmt::Write;

use serde_json::json;
use tandem_episodes::html::{self, escape};
use tandem_tools_spec::{EpisodeEntry, EpisodeList, Operators};

use crate::hosting::Caller;

/// Renders the page of a server of `version` with these episodes and the links for `caller`.
pub fn page(version: &str, list: &EpisodeList, caller: &Caller) -> String {
    let title = format!("Tandem {version}");
    let figures = match caller {
        Caller::Host => "; <a href=\"/metrics\">figures for Prometheus</a>",
        Caller::Operator { .. } => "",
    };
    let mut body = format!("<h1>{}</h1>\n", escape(&title));
    body += &format!(
        "<p>Simulated humanoids that must work together.</p>\n<ul>\n\
         <li><a href=\"/operate\">Operate</a>: drive robots yourself in this browser, alone or with others.</li>\n\
         <li><a href=\"/watch\">Watch</a> episodes and evaluations, by the link that the server printed when it started.</li>\n\
         <li>For programs: <a href=\"/docs\">the interface</a>, <a href=\"/v1/openapi.json\">as OpenAPI</a>; \
         <a href=\"/v1/tasks\">the tasks</a>; <a href=\"/v1/tools\">the tools</a>{figures}. MCP hosts connect to <code>/mcp</code>.</li>\n\
         </ul>\n<h2>Episodes</h2>\n"
    );
    let rows: String = list.episodes.iter().map(row).collect();
    body += &match rows.is_empty() {
        true => "<p>None runs. <a href=\"/operate\">Start one yourself</a>, or have a program start it by <code>POST /v1/episodes</code>.</p>\n".to_owned(),
        false => format!(
            "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Episodes\"><table>\n<tr><th>page</th><th>episode</th><th>task</th><th>seed</th><th>protocol</th><th>driven by</th><th>step</th><th>stands</th></tr>\n\
             {rows}</table></div>\n"
        ),
    };
    html::page(&title, &body)
}

/// Returns the start page for programs, as text.
pub fn brief(version: &str) -> String {
    format!(
        "Tandem {version}: simulated humanoids that must work together.\n\
         GET  /v1/tasks?short=true             the tasks\n\
         POST /v1/episodes                     begins one: {{\"task\": \"handover\", \"seed\": 2000}}; the reply says what there is to know\n\
         GET  /v1/tools                        the tools, as JSON Schema; ?format=openai, anthropic or mcp for their SDKs\n\
         POST /v1/episodes/{{id}}/tools/{{tool}}   calls one; \"short\": true leaves out of the reply what is as it should be\n\
         GET  /docs                            every route in a line; GET /v1/openapi.json all of it as OpenAPI\n\
         GET  /v1/episodes                     the episodes that are held\n\
         POST /mcp                             the same for MCP hosts\n"
    )
}

fn row(entry: &EpisodeEntry) -> String {
    let EpisodeEntry { episode_id, task, seed, protocol, operators, step, ended } = entry;
    let driven = match operators {
        Operators::One => "one policy",
        Operators::PerRobot => "an operator for each robot",
    };
    let stands = match ended {
        None => "goes on".to_owned(),
        Some(reason) => json!(reason).as_str().unwrap_or_default().replace('_', " "),
    };
    let (id, mut row) = (escape(episode_id), String::from("<tr>"));
    // The link comes first, so that it is visible on a phone. It asks for the watch link if necessary.
    // Writing to a string cannot fail.
    let _ = write!(row, "<td><a href=\"/watch?episode={id}\">watch</a></td>");
    let _ = write!(row, "<td><a href=\"/v1/episodes/{id}\">{id}</a></td>");
    for cell in [
        task.clone(),
        seed.map_or_else(|| "-".into(), |seed| seed.to_string()),
        protocol.to_string(),
        driven.into(),
        step.to_string(),
        stands,
    ] {
        let _ = write!(row, "<td>{}</td>", escape(&cell));
    }
    row + "</tr>\n"
}

#[cfg(test)]
mod tests {
    use tandem_tools_spec::{EndReason, Protocol};

    use super::*;

    #[test]
    fn every_episode_has_its_line_and_nothing_breaks_out() {
        let entry = |id: &str, ended: Option<EndReason>| EpisodeEntry {
            episode_id: id.into(),
            task: "handover".into(),
            seed: Some(7),
            protocol: Protocol::Agentic,
            operators: Operators::PerRobot,
            step: 325,
            ended,
        };
        let failed = Some(EndReason::SimulatorFailed);
        let page = page(
            "1.2.3",
            &EpisodeList { episodes: vec![entry("a", None), entry("<b>", failed)] },
            &Caller::Host,
        );
        assert!(page.contains("href=\"/metrics\""), "{page}");
        let rest =
            "<td>handover</td><td>7</td><td>agentic</td><td>an operator for each robot</td><td>325</td>";
        assert!(
            page.contains(&format!("<a href=\"/v1/episodes/a\">a</a></td>{rest}<td>goes on</td>")),
            "{page}"
        );
        assert!(page.contains("<a href=\"/watch?episode=a\">watch</a>"), "{page}");
        assert!(page.contains("<td>simulator failed</td>") && page.contains("&lt;b&gt;"), "{page}");
        for foreign in ["<script", "<b>", "src=", "url(", "http://", "https://", "<link"] {
            assert!(!page.contains(foreign), "{foreign}");
        }
        assert!(brief("1.2.3").contains("POST /v1/episodes/{id}/tools/{tool} "), "{}", brief("1.2.3"));
        let operator = Caller::Operator { episode: "a".into(), robot: "A".into() };
        let page = super::page("1.2.3", &EpisodeList { episodes: Vec::new() }, &operator);
        assert!(
            page.contains("None runs") && page.contains("/v1/tools") && !page.contains("/metrics"),
            "{page}"
        );
    }
}
