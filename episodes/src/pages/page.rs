//! The self-contained page of one episode, `report.html`.

use std::collections::BTreeMap;

use tandem_sim::CONTROL_HZ;
use tandem_tools_spec::{Budget, EndReason, ResultReply, Usage};

use crate::html::{self, escape};
use crate::pages::moments::{self, KeyMoment};
use crate::protocol::Rules;
use crate::scoring::Phase;
use crate::tasks::Task;

/// The page's name in a run folder.
pub const PAGE_FILE: &str = "report.html";

/// Counts of answered and refused calls by tool.
#[derive(Debug, Default)]
pub struct CallCounts(BTreeMap<&'static str, [u32; 2]>);

impl CallCounts {
    pub fn count(&mut self, tool: &'static str, answered: bool) {
        self.0.entry(tool).or_default()[usize::from(!answered)] += 1;
    }
}

/// A message from the operator of a robot to the others, and its time.
#[derive(Clone, Debug, PartialEq)]
pub struct SaidWords {
    pub time_s: f64,
    pub robot: String,
    pub text: String,
}

/// Content of the page.
pub struct EpisodePage<'a> {
    pub task: &'a Task,
    /// The joint instruction.
    pub instruction: &'a str,
    pub result: &'a ResultReply,
    pub calls: &'a CallCounts,
    /// Messages, in the order in which they were sent.
    pub said: &'a [SaidWords],
    /// Simulated time at which the episode began, more than 0 if it began at a phase of another episode.
    pub begin_s: f64,
    /// Limits of the episode.
    pub rules: Rules,
    /// The budget after the last control step; `None` if there was none.
    pub budget_left: Option<Budget>,
    pub moments: &'a [KeyMoment],
}

impl EpisodePage<'_> {
    /// Renders the page.
    pub fn html(&self) -> String {
        let seed = self.result.seed.map(|seed| format!(", seed {seed}")).unwrap_or_default();
        let title = format!("{}{seed}", self.task.id);
        let body = format!(
            r#"<h1>{}</h1>
<p class="soft">{instruction}</p>
<p>{verdict}</p>
<dl class="facts">{facts}</dl>
<h2>Phases</h2>
{timeline}
{phases}
<h2>Key moments</h2>
{moments}
<h2>Budget</h2>
{budget}
{models}{said}<h2>Tool calls</h2>
{calls}
<h2>Recording</h2>
{recording}"#,
            escape(&title),
            instruction = escape(self.instruction),
            verdict = self.verdict(),
            facts = self.facts(),
            timeline = self.timeline(),
            phases = self.phases(),
            moments = moments::html(self.moments, "moments"),
            budget = self.budget(),
            models = self.models(),
            said = self.said(),
            calls = self.tool_calls(),
            recording = self.recording(),
        );
        html::page(&title, &body)
    }

    fn duration_s(&self) -> f64 {
        f64::from(self.result.env_steps) / CONTROL_HZ
    }

    fn verdict(&self) -> String {
        let reached = self.result.phases.0.iter().filter(|(_, time_s)| time_s.is_some()).count();
        let phases = self.task.phases.len();
        let class = if reached == phases { "good" } else { "bad" };
        let why = match self.result.ended {
            EndReason::TaskComplete => "The task was completed.",
            EndReason::StepBudgetExhausted => "The steps ran out.",
            EndReason::WallClockExhausted => "The policy's time ran out.",
            EndReason::Finished => "The policy ended the episode.",
            EndReason::Abandoned => "The policy went away.",
            EndReason::PolicyFailed => "The policy itself failed.",
            EndReason::SimulatorFailed => "The simulator failed.",
        };
        let why = match (&self.result.simulator_failure, self.model_endings()) {
            (Some(failure), _) => format!("The simulator failed {}.", escape(failure)),
            (None, Some(endings)) => endings,
            (None, None) => why.into(),
        };
        format!(r#"<span class="{class}">{reached} of {phases} phases reached.</span> {why}"#)
    }

    /// Returns the models' reasons for ending their play, in the models' words. `None` if the end of the
    /// episode already states the reason.
    fn model_endings(&self) -> Option<String> {
        let endings = self.result.usage.iter().flat_map(Usage::own_endings);
        let told = endings.map(|ended| match ended.text.is_empty() {
            true => format!("{}.", escape(&ended.words())),
            false => format!("{}: \u{201c}{}\u{201d}.", escape(&ended.words()), escape(&ended.text)),
        });
        let told: Vec<String> = told.collect();
        (!told.is_empty()).then(|| told.join(" "))
    }

    fn facts(&self) -> String {
        let beside: Vec<&str> = [&self.result.extra_information, &self.result.departures]
            .into_iter()
            .flatten()
            .map(String::as_str)
            .collect();
        let beside = if beside.is_empty() { "nothing".into() } else { escape(&beside.join(", ")) };
        let facts = [
            ("Protocol", self.result.protocol.name().into()),
            ("Not as in the benchmark", beside),
            ("Simulated time", format!("{:.2} s", self.duration_s())),
            ("Tool calls", self.result.tool_calls.to_string()),
            ("Robots that fell", self.result.falls.to_string()),
            ("Physics, times real time", format!("{:.1}", self.result.realtime_factor)),
        ];
        facts.map(|(name, value)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>")).concat()
    }

    /// Renders one segment per reached phase, proportional to its duration, and the rest of the episode.
    fn timeline(&self) -> String {
        let mut segments = String::new();
        let mut from_s = self.begin_s;
        let percent = |span_s: f64| 100.0 * span_s / self.duration_s().max(f64::MIN_POSITIVE);
        for (number, time_s) in &self.result.phases.0 {
            let Some(time_s) = *time_s else { break };
            if time_s <= self.begin_s && self.begin_s > 0.0 {
                continue;
            }
            let (number, width) = (escape(number), percent(time_s - from_s));
            segments += &format!(r#"<span style="width:{width:.2}%">{number} {time_s:.2} s</span>"#);
            from_s = time_s;
        }
        let end_s = self.begin_s + self.duration_s();
        let rest = percent(end_s - from_s);
        if rest > 0.0 {
            segments += &format!(r#"<span class="rest" style="width:{rest:.2}%"></span>"#);
        }
        let begin_s = self.begin_s;
        format!(
            r#"<div class="timeline">{segments}</div><div class="scale"><span>{begin_s} s</span><span>{end_s:.2} s</span></div>"#
        )
    }

    fn phases(&self) -> String {
        let mut rows = String::new();
        for (index, phase) in self.task.phases.iter().enumerate() {
            let number = Phase::number(index);
            let (class, reached) = match self.result.phases.reached_s(&number) {
                Some(time_s) => ("good", format!("{time_s:.2} s")),
                None => ("bad", "not reached".into()),
            };
            let name = escape(&phase.id.replace('_', " "));
            let who = if phase.collaborative { "together" } else { "alone" };
            let condition = escape(&phase.description);
            rows += &format!(
                r#"<tr><td>{number} {name}</td><td class="{class}">{reached}</td><td>{who}</td><td class="long">{condition}</td></tr>"#
            );
        }
        format!(
            r#"<table class="words"><tr><th>Phase</th><th>Reached at</th><th>Robots work</th><th>Condition</th></tr>{rows}</table>"#
        )
    }

    fn budget(&self) -> String {
        let Rules { episode_steps, initial_hold_steps, thinking, .. } = self.rules;
        let steps = self.result.env_steps;
        let hold = match initial_hold_steps {
            0 => String::new(),
            hold => format!(", {hold} of them the initial hold"),
        };
        let mut rows = format!(
            r#"<tr><td>Control steps of 20 ms</td><td class="long"><meter max="{episode_steps}" value="{steps}"></meter></td><td>{steps} of {episode_steps}{hold}</td></tr>"#
        );
        if let (Some(allowed), Some(left_s)) = (thinking, self.budget_left.and_then(|b| b.wall_clock_left_s))
        {
            let allowed_s = allowed.as_secs_f64();
            let used_s = allowed_s - left_s;
            rows += &format!(
                r#"<tr><td>Policy's own time</td><td class="long"><meter max="{allowed_s}" value="{used_s:.2}"></meter></td><td>{used_s:.1} of {allowed_s:.0} s by the last step</td></tr>"#
            );
        }
        format!(r#"<table class="words">{rows}</table>"#)
    }

    /// Renders the usage of language models: a row for each robot that has separate usage, and the sum.
    fn models(&self) -> String {
        let Some(usage) = &self.result.usage else { return String::new() };
        let row = |robot: &str, model: &str, [input, cached, output]: [u64; 3], costs: [Option<f64>; 2]| {
            let [usd, time_s] = costs;
            let usd = usd.map(|usd| format!("{usd:.4} US dollars")).unwrap_or_default();
            let time_s = time_s.map(|time_s| format!("{time_s:.1} s")).unwrap_or_default();
            let (robot, model) = (escape(robot), escape(model));
            let tokens =
                [format!("{input} tokens read"), format!("{cached} cached"), format!("{output} written")];
            let numbers = tokens.into_iter().chain([usd, time_s]);
            let numbers: String =
                numbers.map(|number| format!(r#"<td class="number">{number}</td>"#)).collect();
            format!(r#"<tr><td>{robot}</td><td class="long">{model}</td>{numbers}</tr>"#)
        };
        let own = usage.robots.iter().map(|own| {
            let tokens = [own.input_tokens, own.cached_tokens, own.output_tokens];
            row(&own.robot, own.model.as_deref().unwrap_or_default(), tokens, [own.usd, own.model_s])
        });
        let tokens = [usage.input_tokens, usage.cached_tokens, usage.output_tokens];
        let all = row("all", &usage.models.join(", "), tokens, [usage.usd, usage.model_s]);
        let rows: String = own.chain([all]).collect();
        format!(
            r#"<h2>Models</h2>
<table class="words"><tr><th>Robots</th><th>Model</th><th class="number" colspan="5">Used</th></tr>{rows}</table>
"#
        )
    }

    /// Renders the messages; empty if there are none.
    fn said(&self) -> String {
        if self.said.is_empty() {
            return String::new();
        }
        let row = |words: &SaidWords| {
            let SaidWords { time_s, robot, text } = words;
            let (robot, text) = (escape(robot), escape(text));
            format!(
                r#"<tr><td class="number">{time_s:.2} s</td><td>{robot}</td><td class="long">{text}</td></tr>"#
            )
        };
        let rows: String = self.said.iter().map(row).collect();
        format!(
            r#"<h2>What was said</h2>
<table class="words"><tr><th class="number">At</th><th>By</th><th>Words</th></tr>{rows}</table>
"#
        )
    }

    fn tool_calls(&self) -> String {
        if self.calls.0.is_empty() {
            return "<p>There were none.</p>".into();
        }
        let mut rows = String::new();
        for (tool, [answered, refused]) in &self.calls.0 {
            rows += &format!(
                r#"<tr><td><code>{tool}</code></td><td class="number">{answered}</td><td class="number">{refused}</td></tr>"#
            );
        }
        format!(
            r#"<table><tr><th>Tool</th><th class="number">Answered</th><th class="number">Refused</th></tr>{rows}</table>"#
        )
    }

    fn recording(&self) -> String {
        let hash = escape(self.result.state_hash.as_deref().unwrap_or_default());
        format!(
            r#"<p><code>episode.mcap</code> beside this page holds every control step. To watch it, open it as a local file in
<a href="https://app.foxglove.dev">Foxglove</a> or any other reader of MCAP.</p>
<ul>
<li>3D panel: fixed frame <code>world</code>, topics <code>/scene</code> and <code>/tf</code>.</li>
<li>Plots: <code>/A/joint_states</code>, <code>/A/action.row[0]</code> (its columns are named in the channel's metadata),
<code>/A/base_command</code>, <code>/budget</code>; the same for the other robots.</li>
<li>Tables: <code>/phases</code> and <code>/tool_calls</code>, where each call stands with its arguments and its reply.</li>
</ul>
<p>The same binary, seed and calls end in the same state, bit for bit: <code>{hash}</code>.</p>"#
        )
    }
}

#[cfg(test)]
mod tests;
