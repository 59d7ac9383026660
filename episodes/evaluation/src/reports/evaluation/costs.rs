//! Costs of episodes: steps, calls and thinking time. If notes report them, also tokens, price and time of
//! models.

use std::collections::{BTreeMap, BTreeSet};

use crate::results::PlayedEpisode;
use serde::Serialize;
use tandem_tools_spec::{AgentEnding, Usage};

/// Costs of episodes that began at the task's beginning.
#[derive(Debug, Serialize)]
pub struct EpisodeCosts {
    pub steps: ValueRange,
    pub calls: ValueRange,
    pub thought: ValueRange,
}

/// Minimum, median and maximum of some values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ValueRange {
    pub min: f64,
    pub median_value: f64,
    pub max: f64,
}

/// Model costs from the notes of a policy's whole episodes. Each value is the sum over an episode.
#[derive(Debug, Serialize)]
pub struct ModelCosts {
    /// Number of episodes that have notes.
    pub episodes: usize,
    /// Input tokens, including those read from a cache.
    pub input_tokens: ValueRange,
    pub output_tokens: ValueRange,
    /// Share of the input tokens that were read from a cache; `None` without input tokens.
    pub cached_share: Option<f64>,
    /// Price in US dollars; `None` if no note reports it.
    pub usd: Option<ValueRange>,
    /// Sum of the prices of all episodes.
    pub total_usd: Option<f64>,
    /// Response time of models in seconds; `None` if no note reports it.
    pub model_time: Option<ValueRange>,
    pub models: BTreeSet<String>,
}

impl ModelCosts {
    /// Sums up the notes of these episodes; `None` if none has notes.
    pub fn of(episodes: &[&PlayedEpisode]) -> Option<ModelCosts> {
        let used: Vec<&Usage> = episodes.iter().filter_map(|played| played.result.usage.as_ref()).collect();
        let range = |of: fn(&Usage) -> Option<f64>| {
            ValueRange::of(used.iter().filter_map(|usage| of(usage)).collect())
        };
        let total = |of: fn(&Usage) -> u64| used.iter().map(|usage| of(usage)).sum::<u64>() as f64;
        let (input, cached) = (total(|usage| usage.input_tokens), total(|usage| usage.cached_tokens));
        let usd = range(|usage| usage.usd);
        Some(ModelCosts {
            episodes: used.len(),
            input_tokens: range(|usage| Some(usage.input_tokens as f64))?,
            output_tokens: range(|usage| Some(usage.output_tokens as f64))?,
            cached_share: (input > 0.0).then(|| cached / input),
            total_usd: usd.is_some().then(|| used.iter().filter_map(|usage| usage.usd).sum()),
            usd,
            model_time: range(|usage| usage.model_s),
            models: used.iter().flat_map(|usage| usage.models.iter().cloned()).collect(),
        })
    }
}

/// Model costs of episodes that count, and of those that do not count but were paid for as well.
#[derive(Debug, Serialize)]
pub struct AskedCosts {
    pub counted: CostSum,
    pub not_counted: CostSum,
    /// Number of endings by kind, one for each episode and model, whether the episode counts or not.
    pub endings: BTreeMap<AgentEnding, usize>,
}

/// Sum of the costs that notes report.
#[derive(Debug, Default, Serialize)]
pub struct CostSum {
    /// Number of episodes that have notes.
    pub episodes: usize,
    /// Input tokens, including those read from a cache.
    pub input_tokens: u64,
    pub output_tokens: u64,
    /// `None` if no note reports it.
    pub usd: Option<f64>,
}

impl AskedCosts {
    /// Sums up the notes of these episodes; `None` if none has notes.
    pub fn of(counted: &[&PlayedEpisode], not_counted: &[&PlayedEpisode]) -> Option<AskedCosts> {
        let mut endings = BTreeMap::new();
        let usages = counted.iter().chain(not_counted).filter_map(|played| played.result.usage.as_ref());
        for ended in usages.flat_map(|usage| &usage.endings) {
            *endings.entry(ended.ending).or_default() += 1;
        }
        let costs =
            AskedCosts { counted: CostSum::of(counted), not_counted: CostSum::of(not_counted), endings };
        (costs.counted.episodes + costs.not_counted.episodes > 0).then_some(costs)
    }
}

impl CostSum {
    fn of(episodes: &[&PlayedEpisode]) -> CostSum {
        episodes.iter().filter_map(|played| played.result.usage.as_ref()).fold(
            CostSum::default(),
            |sum, usage| CostSum {
                episodes: sum.episodes + 1,
                input_tokens: sum.input_tokens + usage.input_tokens,
                output_tokens: sum.output_tokens + usage.output_tokens,
                usd: usage.usd.map(|usd| sum.usd.unwrap_or_default() + usd).or(sum.usd),
            },
        )
    }
}

impl EpisodeCosts {
    /// Returns the costs of these episodes; `None` if there are none.
    pub fn of(episodes: &[&PlayedEpisode]) -> Option<EpisodeCosts> {
        let spread = |of: fn(&PlayedEpisode) -> f64| {
            ValueRange::of(episodes.iter().map(|played| of(played)).collect())
        };
        Some(EpisodeCosts {
            steps: spread(|played| played.result.env_steps.into())?,
            calls: spread(|played| played.requests().into())?,
            thought: spread(|played| played.thought_s)?,
        })
    }
}

impl ValueRange {
    /// Returns the range of these values; `None` if there are none.
    pub fn of(mut values: Vec<f64>) -> Option<ValueRange> {
        values.sort_by(f64::total_cmp);
        let (min, max) = (*values.first()?, *values.last()?);
        let middle = values.len() / 2;
        let median_value = match values.len() % 2 {
            0 => (values[middle - 1] + values[middle]) / 2.0,
            _ => values[middle],
        };
        Some(ValueRange { min, median_value, max })
    }
}

#[cfg(test)]
mod tests {
    use tandem_tools_spec::{EndReason, ModelEnding};

    use super::*;
    use crate::reports::evaluation::tests::{found, nine_six_three};
    use crate::reports::evaluation::{EvaluationReport, FailureMoment, ReportFormat, ReportPictures};

    #[test]
    fn what_does_not_count_was_asked_and_paid_all_the_same() {
        let mut episodes = nine_six_three("agent");
        for (played, ending) in episodes.iter_mut().zip([AgentEnding::Finished, AgentEnding::Endpoint]) {
            let ended = ModelEnding { robot: None, ending, text: "I cannot.".into() };
            let usage =
                Usage { input_tokens: 10_000, usd: Some(0.06), endings: vec![ended], ..Usage::default() };
            played.result.usage = Some(usage);
        }
        episodes[1].result.ended = EndReason::PolicyFailed;
        episodes[1].result.phases.0.iter_mut().for_each(|(_, time_s)| *time_s = None);
        let report = EvaluationReport::of(&found(episodes));
        let text = report.write(ReportFormat::Markdown, &ReportPictures::default()).unwrap();
        for line in [
            "| agent | 1 | 10.0 | 0.0 | 0.060 | 1 | 10.0 | 0.0 | 0.060 | 0.120 |",
            "| agent | the policy ended the episode | 1 |",
            "| agent | the model's endpoint gave no reply | 1 |",
        ] {
            assert!(text.contains(line), "no {line}: {text}");
        }
    }

    /// Compares an expert without notes with an agent that has notes in half of its episodes.
    #[test]
    fn agents_are_compared_by_what_their_notes_say() {
        let mut episodes = nine_six_three("agent");
        for played in episodes.iter_mut().step_by(2) {
            played.result.usage = Some(Usage {
                notes: 3,
                input_tokens: 10_000,
                output_tokens: 500,
                cached_tokens: 4_000,
                usd: Some(0.06),
                model_s: Some(12.5),
                models: vec!["a-model".into()],
                ..Usage::default()
            });
        }
        let silent = EvaluationReport::of(&found(nine_six_three("agent")));
        episodes.extend(nine_six_three("expert"));
        let mut report = EvaluationReport::of(&found(episodes));
        let watch = "http://127.0.0.1:8700/watch?run=a&at=11.5";
        report.failure_moments = vec![FailureMoment {
            policy: "agent".into(),
            task: "handover".into(),
            seed: 9,
            phase: "p1".into(),
            what: "A fell".into(),
            time_s: 12.5,
            watch: watch.into(),
            page: Some("episodes/handover-9/report.html".into()),
        }];
        let write =
            |report: &EvaluationReport, format| report.write(format, &ReportPictures::default()).unwrap();
        let text = write(&report, ReportFormat::Markdown);
        let agent = "| agent | handover | 3/10 | 1.8 of 3 | 504 | 60 | 4.5 | 12.5 | 10.0 | 40 % | 0.5 | 0.060 | 0.100 |";
        let expert = "| expert | handover | 3/10 | 1.8 of 3 | 504 | 60 | 4.5 | - | - | - | - | - | - |";
        let moment = format!(
            "| agent | handover | 9 | p1 | A fell | [page](episodes/handover-9/report.html) | [12.5]({watch}) |"
        );
        for line in [agent, expert, &moment] {
            assert!(text.contains(line), "no {line}: {text}");
        }
        assert!(!write(&silent, ReportFormat::Markdown).contains("## Agents"));
        let page = write(&report, ReportFormat::Html);
        assert!(page.contains(&format!("<a href=\"{}\">12.5</a>", watch.replace('&', "&amp;"))), "{page}");
        let csv = write(&report, ReportFormat::Csv);
        assert!(csv.lines().nth(1).unwrap().ends_with(",504.5,60,4.5,10000,500,0.06"), "{csv}");
        assert!(csv.lines().last().unwrap().ends_with(",504.5,60,4.5,,,"), "{csv}");
        let json: serde_json::Value = serde_json::from_str(&write(&report, ReportFormat::Json)).unwrap();
        let models = &json["policies"][0]["tasks"][0]["models"];
        assert_eq!((&models["episodes"], &models["models"][0]), (&5.into(), &"a-model".into()));
        assert_eq!(json["failure_moments"][0]["watch"], watch);
        assert!(write(&report, ReportFormat::Tex).contains("A fell & page & 12.5"));
    }
}
