//! Language models of single robots, in place of the common model.

use serde_json::{Map, Value};
use tandem_tools_spec::Usage;

use super::agent::{AgentFlags, AgentPrices};

/// Models of single robots.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct RobotModels {
    /// With --per-robot: model of one robot with its own flags, for example
    /// "B=claude-opus-5-5?api=anthropic&max-usd=2". It shares only limits with the model of the others,
    /// unless it has its own. Can be repeated.
    #[arg(long = "robot-model", value_name = "ROBOT=MODEL", requires = "per_robot", value_parser = parse_model)]
    models: Vec<RobotModel>,
}

/// Model of one robot.
#[derive(Debug, Clone)]
struct RobotModel {
    robot: String,
    flags: AgentFlags,
    /// Text on the command line.
    text: String,
}

fn parse_model(text: &str) -> Result<RobotModel, String> {
    let example = "give a robot and its model, for example B=MODEL or B=MODEL?api=anthropic&max-usd=2";
    let (robot, model) = text.split_once('=').ok_or(example)?;
    if robot.is_empty() || robot.contains('?') {
        return Err(example.into());
    }
    let flags = AgentFlags::parse_policy(model)?;
    Ok(RobotModel { robot: robot.into(), flags, text: text.into() })
}

impl RobotModels {
    /// Returns true if no robot has a separate model.
    pub fn is_empty(&self) -> bool {
        self.models.is_empty()
    }

    /// Returns the arguments for Python.
    pub fn arguments(&self) -> impl Iterator<Item = String> {
        self.models.iter().map(|model| format!("--robot-model={}", model.text))
    }

    /// Returns the addition to the policy's name, which is empty without models of single robots.
    pub fn name(&self) -> String {
        self.models.iter().map(|model| format!(" {}={}", model.robot, model.flags.model())).collect()
    }

    /// Returns the cards of the models by robot; `None` if there are none.
    pub fn cards(&self) -> Option<Value> {
        let cards: Map<String, Value> =
            self.models.iter().map(|model| (model.robot.clone(), model.flags.card())).collect();
        (!cards.is_empty()).then(|| cards.into())
    }

    /// Returns the time limit of programs whose limit without these models is `usual_s`.
    pub fn limit_s(&self, usual_s: u32) -> u32 {
        self.models.iter().map(|model| model.flags.limit_s(usual_s)).fold(usual_s, u32::max)
    }
}

/// Prices of the models of a policy.
#[derive(Debug, Clone, Default)]
pub struct PolicyPrices {
    common: AgentPrices,
    robots: Vec<(String, AgentPrices)>,
}

impl PolicyPrices {
    pub fn new(common: AgentPrices, models: &RobotModels) -> PolicyPrices {
        let robots = models.models.iter().map(|model| (model.robot.clone(), model.flags.prices()));
        PolicyPrices { common, robots: robots.collect() }
    }

    /// Returns true if each model has the prices of input and output.
    pub fn are_given(&self) -> bool {
        self.common.are_given() && self.robots.iter().all(|(_, prices)| prices.are_given())
    }

    /// Returns the price of a usage. `None` without prices, or if robots have separate models and the usage
    /// has no token counts per robot.
    pub fn usd(&self, usage: &Usage) -> Option<f64> {
        if self.robots.is_empty() {
            return self.common.usd([usage.input_tokens, usage.cached_tokens, usage.output_tokens]);
        }
        let parts = usage.robots.iter().map(|part| {
            let own = self.robots.iter().find(|(robot, _)| *robot == part.robot);
            let prices = own.map_or(&self.common, |(_, prices)| prices);
            prices.usd([part.input_tokens, part.cached_tokens, part.output_tokens])
        });
        (!usage.robots.is_empty()).then(|| parts.sum::<Option<f64>>()).flatten()
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use tandem_tools_spec::RobotUsage;

    use super::*;

    #[derive(Debug, Parser)]
    #[command(no_binary_name = true)]
    struct ModelLine {
        #[command(flatten)]
        models: RobotModels,
        #[arg(long)]
        per_robot: bool,
    }

    fn parse(flags: &[&str]) -> Result<RobotModels, String> {
        let line = ModelLine::try_parse_from(flags).map_err(|error| error.to_string())?;
        Ok(line.models)
    }

    const PRICED: &str =
        "B=m?api=anthropic&usd-per-million-input=10&usd-per-million-output=100&max-seconds=9000";

    #[test]
    fn a_robot_has_a_model_with_its_own_flags() {
        let models = parse(&["--per-robot", "--robot-model", PRICED, "--robot-model", "C=n:8b"]).unwrap();
        let arguments: Vec<String> = models.arguments().collect();
        assert_eq!(arguments, [format!("--robot-model={PRICED}"), "--robot-model=C=n:8b".into()]);
        assert_eq!((models.name().as_str(), models.limit_s(3600)), (" B=m C=n:8b", 9300));
        let cards = models.cards().unwrap();
        assert_eq!((&cards["B"]["api"], &cards["C"]["model"]), (&"anthropic".into(), &"n:8b".into()));
        assert_eq!((RobotModels::default().cards(), RobotModels::default().limit_s(5)), (None, 5));
    }

    #[test]
    fn what_is_no_model_of_a_robot_is_told_what_is() {
        for (flags, says) in [
            (&["--per-robot", "--robot-model", "claude"][..], "for example B=MODEL"),
            (&["--per-robot", "--robot-model", "m?api=anthropic"], "for example B=MODEL"),
            (&["--per-robot", "--robot-model", "B="], "no model"),
            (&["--per-robot", "--robot-model", "B=m?key=1"], "unexpected argument '--key' found"),
            (&["--robot-model", "B=m"], "--per-robot"),
        ] {
            let refused = parse(flags).unwrap_err();
            assert!(refused.contains(says), "{refused}");
        }
    }

    #[test]
    fn each_robot_is_priced_by_its_own_model() {
        let common = AgentPrices { input_usd: Some(1.0), output_usd: Some(2.0), cached_usd: None };
        let prices = PolicyPrices::new(common, &parse(&["--per-robot", "--robot-model", PRICED]).unwrap());
        let part = |robot: &str| RobotUsage {
            robot: robot.into(),
            input_tokens: 1_000_000,
            output_tokens: 100_000,
            ..RobotUsage::default()
        };
        let usage = Usage { robots: vec![part("A"), part("B")], ..Usage::default() };
        assert_eq!((prices.are_given(), prices.usd(&usage)), (true, Some(1.2 + 20.0)));
        assert_eq!(prices.usd(&Usage::default()), None, "nothing says what each used");
        let free = PolicyPrices::new(common, &parse(&["--per-robot", "--robot-model", "B=m"]).unwrap());
        assert_eq!((free.are_given(), free.usd(&usage)), (false, None));
    }
}
