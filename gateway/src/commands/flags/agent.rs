//! The flags for the choice and the limits of a language model. `python -m tandem.agent` has the same flags
//! and parses them.

use std::iter;

use clap::{CommandFactory, Parser};
use serde_json::Value;

/// Share of a program's time limit after which a model finishes its play itself, in twelfths.
const OWN_TWELFTHS: u32 = 11;

/// Flags whose values are strings, even if they look like numbers.
const TEXTS: [&str; 4] = ["model", "api", "base-url", "effort"];

/// Time after the model's own time limit at which the program is stopped.
const GRACE_S: u32 = 300;

/// A language model.
#[derive(Debug, Clone, clap::Args)]
pub struct AgentFlags {
    /// Name of the model at its endpoint.
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// API of the endpoint: OpenAI's Responses, its Chat Completions (Ollama, vLLM and most others), or
    /// Anthropic's Messages.
    #[arg(long, value_name = "API", default_value = "openai", value_parser = ["openai", "openai-chat", "anthropic"])]
    api: String,
    /// URL of the endpoint, for example http://127.0.0.1:11434/v1 [default: that of the API's vendor].
    #[arg(long, value_name = "URL")]
    base_url: Option<String>,
    /// Reasoning effort in the API's terms, for example low or high [default: that of the model].
    #[arg(long, value_name = "WORD")]
    effort: Option<String>,
    /// Sampling temperature [default: the endpoint's].
    #[arg(long = "temperature", value_name = "T", value_parser = parse_amount)]
    temperature_value: Option<f64>,
    /// Probability mass of the tokens to sample from [default: the endpoint's].
    #[arg(long = "top-p", value_name = "P", value_parser = parse_amount)]
    top_share: Option<f64>,
    /// Sampling seed, for openai-chat [default: the endpoint's].
    #[arg(long, value_name = "N")]
    sampling_seed: Option<u32>,
    /// Additional fields of each request to the endpoint, for example {"top_k": 40} [default: none].
    #[arg(long, value_name = "JSON", value_parser = parse_object)]
    extra_body: Option<String>,
    /// Maximum length of the conversation in tokens; the older half of a longer one becomes a list of calls
    /// [default: 100000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    context_tokens: Option<u32>,
    /// Maximum number of input and output tokens of an episode, after which it is finished [default:
    /// unlimited].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    max_tokens_total: Option<u64>,
    /// Maximum cost of an episode in US dollars by the prices below, after which it is finished [default:
    /// unlimited].
    #[arg(long, value_name = "USD")]
    max_usd: Option<f64>,
    /// Maximum number of tool calls of an episode, after which it is finished [default: 500].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    max_calls: Option<u32>,
    /// Maximum time of an episode, after which it is finished [default: 3300].
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..))]
    max_seconds: Option<u32>,
    /// Price of a million input tokens.
    #[arg(long = "usd-per-million-input", value_name = "USD")]
    million_input_usd: Option<f64>,
    /// Price of a million output tokens.
    #[arg(long = "usd-per-million-output", value_name = "USD")]
    million_output_usd: Option<f64>,
    /// Price of a million cached input tokens [default: the price of input tokens].
    #[arg(long = "usd-per-million-cached", value_name = "USD")]
    million_cached_usd: Option<f64>,
}

/// Prices of a million tokens in US dollars; `None` if they are not given.
#[derive(Debug, Clone, Copy, Default)]
pub struct AgentPrices {
    pub input_usd: Option<f64>,
    pub output_usd: Option<f64>,
    pub cached_usd: Option<f64>,
}

impl AgentPrices {
    /// Returns true if the prices of input and output are given.
    pub fn are_given(&self) -> bool {
        self.input_usd.is_some() && self.output_usd.is_some()
    }

    /// Returns the price of the numbers of input tokens, cached input tokens and output tokens. `None`
    /// without the prices of input and output. Writing to a cache is priced as reading.
    pub fn usd(&self, [input, cached, output]: [u64; 3]) -> Option<f64> {
        let (input_usd, output_usd) = (self.input_usd?, self.output_usd?);
        let cached_usd = self.cached_usd.unwrap_or(input_usd);
        let fresh = input.saturating_sub(cached);
        let parts = [(fresh, input_usd), (cached, cached_usd), (output, output_usd)];
        Some(parts.into_iter().map(|(tokens, usd)| tokens as f64 / 1e6 * usd).sum())
    }
}

fn parse_amount(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite() && *number >= 0.0);
    number.ok_or_else(|| "give a number from 0 up".into())
}

fn parse_object(text: &str) -> Result<String, String> {
    match serde_json::from_str(text) {
        Ok(Value::Object(_)) => Ok(text.into()),
        Ok(_) => Err("give a JSON object, for example {\"top_k\": 40}".into()),
        Err(error) => Err(format!("no JSON ({error}); give an object, for example {{\"top_k\": 40}}")),
    }
}

/// The flags after `agent:`.
#[derive(Debug, Parser)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct AgentOptions {
    #[command(flatten)]
    flags: AgentFlags,
}

impl AgentFlags {
    /// Parses the text after `agent:` on the command line, for example MODEL or
    /// MODEL?api=anthropic&max-usd=2.
    pub fn parse_policy(text: &str) -> Result<AgentFlags, String> {
        let (model, options) = text.split_once('?').unwrap_or((text, ""));
        if model.trim().is_empty() {
            return Err(
                "no model; give one, for example agent:MODEL or agent:MODEL?api=anthropic&max-usd=2".into()
            );
        }
        let options = options.split('&').filter(|option| !option.is_empty());
        let arguments =
            iter::once(format!("--model={model}")).chain(options.map(|option| format!("--{option}")));
        let refused = |error: clap::Error| {
            let text = error.to_string();
            let lines = text.lines().take_while(|line| !line.trim().is_empty()).map(str::trim);
            let said = lines.collect::<Vec<_>>().join(" ");
            let said = said.trim_start_matches("error: ");
            format!("{said}; an option of agent: is one of {}", options_of_agents())
        };
        AgentOptions::try_parse_from(arguments).map(|options| options.flags).map_err(refused)
    }

    /// Returns the model's name; empty if none is given, as in a resumed episode.
    pub fn model(&self) -> &str {
        self.model.as_deref().unwrap_or_default()
    }

    pub fn prices(&self) -> AgentPrices {
        AgentPrices {
            input_usd: self.million_input_usd,
            output_usd: self.million_output_usd,
            cached_usd: self.million_cached_usd,
        }
    }

    /// Returns the time limit of a program whose default limit is `usual_s`.
    pub fn limit_s(&self, usual_s: u32) -> u32 {
        usual_s.max(self.max_seconds.map_or(0, |own_s| own_s.saturating_add(GRACE_S)))
    }

    /// Returns the arguments for Python, for a program that is stopped after `limit_s`.
    pub fn arguments(&self, limit_s: u32) -> Vec<String> {
        let own_s = self.max_seconds.unwrap_or((limit_s / 12 * OWN_TWELFTHS).max(1));
        let own_s = ("max-seconds", Some(own_s.to_string()));
        let given = self.given().into_iter().filter(|(flag, _)| *flag != "max-seconds");
        let written = |(flag, value): (&str, Option<String>)| value.map(|value| format!("--{flag}={value}"));
        given.chain([own_s]).filter_map(written).collect()
    }

    /// Returns the policy's card in results.
    pub fn card(&self) -> Value {
        let read = |flag: &str, value: String| match TEXTS.contains(&flag) {
            true => Value::String(value),
            false => serde_json::from_str(&value).unwrap_or(Value::String(value)),
        };
        let given = self.given().into_iter();
        let given = given.filter_map(|(flag, value)| Some((flag.replace('-', "_"), read(flag, value?))));
        Value::Object(given.collect())
    }

    /// Returns each flag with its value.
    fn given(&self) -> [(&'static str, Option<String>); 16] {
        let text = |number: Option<f64>| number.map(|number| number.to_string());
        [
            ("model", self.model.clone()),
            ("api", Some(self.api.clone())),
            ("base-url", self.base_url.clone()),
            ("effort", self.effort.clone()),
            ("temperature", text(self.temperature_value)),
            ("top-p", text(self.top_share)),
            ("sampling-seed", self.sampling_seed.map(|number| number.to_string())),
            ("extra-body", self.extra_body.clone()),
            ("context-tokens", self.context_tokens.map(|number| number.to_string())),
            ("max-tokens-total", self.max_tokens_total.map(|number| number.to_string())),
            ("max-usd", text(self.max_usd)),
            ("max-calls", self.max_calls.map(|number| number.to_string())),
            ("max-seconds", self.max_seconds.map(|number| number.to_string())),
            ("usd-per-million-input", text(self.million_input_usd)),
            ("usd-per-million-output", text(self.million_output_usd)),
            ("usd-per-million-cached", text(self.million_cached_usd)),
        ]
    }
}

/// Lists the names of the flags except the model's.
fn options_of_agents() -> String {
    let command = AgentOptions::command();
    let names = command.get_arguments().filter_map(clap::Arg::get_long).filter(|name| *name != "model");
    names.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_agent_is_named_with_its_flags() {
        let plain = AgentFlags::parse_policy("org/model:8b").unwrap();
        assert_eq!(plain.arguments(3600), ["--model=org/model:8b", "--api=openai", "--max-seconds=3300"]);
        assert_eq!(plain.limit_s(3600), 3600);
        let text = "m?api=openai-chat&base-url=http://127.0.0.1:11434/v1&max-usd=0.5&max-seconds=9000&usd-per-million-input=1.25";
        let flags = AgentFlags::parse_policy(text).unwrap();
        let expected = [
            "--model=m",
            "--api=openai-chat",
            "--base-url=http://127.0.0.1:11434/v1",
            "--max-usd=0.5",
            "--usd-per-million-input=1.25",
            "--max-seconds=9000",
        ];
        assert_eq!(flags.arguments(flags.limit_s(3600)), expected);
        assert_eq!(flags.limit_s(3600), 9300);
        let card = flags.card();
        assert_eq!((&card["base_url"], &card["max_usd"]), (&"http://127.0.0.1:11434/v1".into(), &0.5.into()));
    }

    #[test]
    fn sampling_is_handed_on_and_recorded() {
        let text = "m?temperature=0&top-p=0.9&sampling-seed=7&extra-body={\"top_k\":40}";
        let flags = AgentFlags::parse_policy(text).unwrap();
        let arguments = flags.arguments(3600);
        for says in ["--temperature=0", "--top-p=0.9", "--sampling-seed=7", "--extra-body={\"top_k\":40}"] {
            assert!(arguments.iter().any(|argument| argument == says), "{arguments:?}");
        }
        assert_eq!(flags.card()["extra_body"]["top_k"], 40);
        for (text, says) in [
            ("m?extra-body=[1]", "give a JSON object"),
            ("m?temperature=-1", "from 0 up"),
            ("m?top-p=nan", "from 0 up"),
        ] {
            let refused = AgentFlags::parse_policy(text).unwrap_err();
            assert!(refused.contains(says), "{refused}");
        }
    }

    #[test]
    fn every_flag_is_handed_on() {
        let flags = AgentFlags::parse_policy("m").unwrap();
        let handed: Vec<&str> =
            flags.given().iter().map(|(flag, _)| *flag).filter(|flag| *flag != "model").collect();
        assert_eq!(handed.join(", "), options_of_agents());
    }
}
