//! `report.html`: one episode on one page that needs nothing else.

use std::collections::BTreeMap;
use std::fmt::Write;

use base64::{Engine, prelude::BASE64_STANDARD};
use tandem_tools_spec::ResultReply;

use crate::tasks::Task;

/// Answered and refused calls by tool.
#[derive(Debug, Default)]
pub struct CallCounts(BTreeMap<&'static str, [u32; 2]>);

impl CallCounts {
    pub fn count(&mut self, tool: &'static str, answered: bool) {
        self.0.entry(tool).or_default()[usize::from(!answered)] += 1;
    }
}

const STYLE: &str = "
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }
h1 { margin-bottom: 0; } .lead { margin-top: 0; opacity: .75; }
table { border-collapse: collapse; margin: 1rem 0; } th, td { padding: .3rem .9rem .3rem 0; text-align: left; vertical-align: top; }
tr + tr { border-top: 1px solid #8884; } .yes { color: #1a8f4c; font-weight: 600; } .no { color: #c0392b; font-weight: 600; }
.bar { position: relative; height: 1.6rem; background: #8883; border-radius: .3rem; margin: 1.5rem 0 2.2rem; }
.bar i { position: absolute; top: 0; bottom: 0; width: 3px; background: #1a8f4c; } .bar i span { position: absolute; top: 1.7rem; font-style: normal; font-size: .8rem; }
img { max-width: 100%; } code { background: #8882; padding: .1rem .3rem; border-radius: .2rem; }
";

/// The page for a finished episode; `strip` is a PNG file.
pub fn page(task: &Task, result: &ResultReply, calls: &CallCounts, strip: &[u8]) -> String {
    let mut html = String::new();
    let duration_s = f64::from(result.env_steps) / tandem_sim::CONTROL_HZ;
    let title = format!("{}, seed {}", escape(task.id), result.seed);
    // Writing to a string does not fail.
    let _ = write!(
        html,
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title><style>{STYLE}</style></head>\
         <body><h1>{title}</h1><p class=\"lead\">{}</p>",
        escape(task.instruction)
    );
    html.push_str("<table><tr><th>Phase</th><th>Reached</th><th>Condition</th></tr>");
    for (index, phase) in task.phases.iter().enumerate() {
        let id = crate::describe::phase_id(index);
        let (class, reached) = match result.phases.reached_s(&id) {
            Some(time_s) => ("yes", format!("{time_s:.2} s")),
            None => ("no", "not reached".to_string()),
        };
        let name = escape(&phase.id.replace('_', " "));
        let together = if phase.collaborative { " (together)" } else { "" };
        let _ = write!(
            html,
            "<tr><td>{id} {name}{together}</td><td class=\"{class}\">{reached}</td><td>{}</td></tr>",
            escape(phase.description)
        );
    }
    html.push_str("</table><div class=\"bar\">");
    for (id, time_s) in result.phases.0.iter().filter_map(|(id, time_s)| time_s.map(|time_s| (id, time_s))) {
        let percent = 100.0 * time_s / duration_s.max(f64::MIN_POSITIVE);
        let _ = write!(html, "<i style=\"left:{percent:.1}%\"><span>{} {time_s:.1} s</span></i>", escape(id));
    }
    let image = BASE64_STANDARD.encode(strip);
    let _ = write!(html, "</div><img alt=\"key moments\" src=\"data:image/png;base64,{image}\">");
    let facts = [
        ("Duration", format!("{duration_s:.2} s, {} control steps", result.env_steps)),
        ("Tool calls", result.tool_calls.to_string()),
        ("Robots that fell", result.falls.to_string()),
        ("Real-time factor", format!("{:.1}", result.realtime_factor)),
        ("State hash", format!("<code>{}</code>", escape(&result.state_hash))),
        ("Recording", "<code>episode.mcap</code>, opens in Foxglove".to_string()),
    ];
    html.push_str("<table>");
    for (name, value) in facts {
        let _ = write!(html, "<tr><th>{name}</th><td>{value}</td></tr>");
    }
    html.push_str("</table><table><tr><th>Tool</th><th>Answered</th><th>Refused</th></tr>");
    for (tool, [answered, refused]) in &calls.0 {
        let _ = write!(html, "<tr><td>{tool}</td><td>{answered}</td><td>{refused}</td></tr>");
    }
    html.push_str("</table></body></html>\n");
    html
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
