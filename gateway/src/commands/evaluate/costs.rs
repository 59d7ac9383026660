//! Costs of language models: a limit on the whole run, and an estimate of the cost of a run.

use std::{
    error::Error,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use tandem_episodes::EpisodeSpec;
use tandem_evaluation::{
    evaluation::Evaluation,
    policies::{EpisodeOutput, PlayError, PlayOutcome, Policy, PolicyWait},
    reports::load,
    results::PolicyCard,
};
use tandem_tools_spec::Usage;

use crate::commands::flags::PolicyPrices;

/// A policy that begins no further episode if the cost of the run might then exceed a limit.
#[derive(Debug)]
pub struct SpendingLimit {
    policy: Box<dyn Policy>,
    /// Maximum cost of the run in US dollars; `None` for no limit.
    most_usd: Option<f64>,
    spent: Mutex<Spent>,
}

/// Costs of a run so far, in US dollars.
#[derive(Debug, Default)]
struct Spent {
    usd: f64,
    /// Cost of the most expensive episode so far.
    dearest_usd: f64,
    /// Number of episodes that are being played.
    under_way: u32,
}

impl SpendingLimit {
    pub fn new(policy: Box<dyn Policy>, most_usd: Option<f64>) -> SpendingLimit {
        SpendingLimit { policy, most_usd, spent: Mutex::default() }
    }

    /// Returns true if there is a limit.
    pub fn is_limited(&self) -> bool {
        self.most_usd.is_some()
    }

    /// Adds the costs of episodes that an earlier run has played.
    pub fn add_kept(&self, kept: &Evaluation) {
        for played in &kept.episodes {
            let attempts = played.attempts.iter().map(|attempt| attempt.usage.as_ref());
            attempts.chain([played.result.usage.as_ref()]).for_each(|usage| self.spent().add(usage));
        }
    }

    fn spent(&self) -> MutexGuard<'_, Spent> {
        // Nothing panics while it holds the lock.
        self.spent.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins an episode.
    ///
    /// # Errors
    ///
    /// [`PlayError::Absent`] if the cost of the run might then exceed the limit.
    fn begin(&self) -> Result<(), PlayError> {
        let mut spent = self.spent();
        let next_usd = spent.dearest_usd * f64::from(spent.under_way + 1);
        match self.most_usd.filter(|most_usd| spent.usd + next_usd > *most_usd || spent.usd >= *most_usd) {
            Some(most_usd) => Err(PlayError::Absent(format!(
                "the run has cost {:.2} US dollars, and another episode may pass --max-usd {most_usd}; give a larger one",
                spent.usd
            ))),
            None => {
                spent.under_way += 1;
                Ok(())
            }
        }
    }

    fn end(&self, played: &Result<PlayOutcome, PlayError>) {
        let mut spent = self.spent();
        spent.under_way -= 1;
        spent.add(played.as_ref().ok().and_then(|outcome| outcome.result.usage.as_ref()));
    }
}

impl Spent {
    fn add(&mut self, usage: Option<&Usage>) {
        let usd = usage.and_then(|usage| usage.usd).unwrap_or_default();
        self.usd += usd;
        self.dearest_usd = self.dearest_usd.max(usd);
    }
}

impl Policy for SpendingLimit {
    fn card(&self) -> PolicyCard {
        self.policy.card()
    }

    fn play_episode(&self, spec: &EpisodeSpec, output: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        self.begin()?;
        let played = self.policy.play_episode(spec, output);
        self.end(&played);
        played
    }

    fn waiting(&self) -> Option<PolicyWait> {
        self.policy.waiting()
    }

    fn is_interrupted(&self) -> bool {
        self.policy.is_interrupted()
    }
}

/// Describes the cost of `episodes` episodes at these prices, if each uses as many tokens as the episodes in
/// `folder` did on average.
///
/// # Errors
///
/// Fails if the folder cannot be read, or if a model played none of its episodes.
pub fn expected(episodes: usize, folder: &Path, prices: &PolicyPrices) -> Result<String, Box<dyn Error>> {
    let loaded = load(&[PathBuf::from(folder)])?;
    let used: Vec<&Usage> =
        loaded.episodes.iter().filter_map(|found| found.played.result.usage.as_ref()).collect();
    if used.is_empty() {
        let folder = folder.display();
        return Err(format!(
            "{folder} has no episode with the tokens of a model; give a folder that `agent`, or `evaluate` with agent:MODEL, wrote"
        )
        .into());
    }
    Ok(in_words(episodes, &used, prices))
}

fn in_words(episodes: usize, used: &[&Usage], prices: &PolicyPrices) -> String {
    let mean = |of: fn(&Usage) -> u64| {
        used.iter().map(|usage| of(usage)).sum::<u64>() as f64 / used.len() as f64 / 1000.0
    };
    let tokens = format!(
        "{episodes} to play; in {} recorded, models read {:.0} thousand tokens an episode ({:.0} from a cache) and wrote {:.0}",
        used.len(),
        mean(|usage| usage.input_tokens),
        mean(|usage| usage.cached_tokens),
        mean(|usage| usage.output_tokens)
    );
    // Given prices replace the recorded ones.
    let usd: Option<f64> = used.iter().map(|usage| prices.usd(usage).or(usage.usd)).sum();
    let price = match usd.map(|usd| usd / used.len() as f64) {
        Some(usd) => {
            format!("{usd:.2} US dollars an episode, {:.2} for all", usd * episodes as f64)
        }
        None => "for the price give usd-per-million-input and usd-per-million-output with the model".into(),
    };
    format!("{tokens}: {price}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::flags::{AgentFlags, RobotModels};

    #[derive(Debug)]
    struct Nobody;

    impl Policy for Nobody {
        fn card(&self) -> PolicyCard {
            "nobody".into()
        }

        fn play_episode(&self, _: &EpisodeSpec, _: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
            Err(PlayError::NotReady("nobody plays".into()))
        }
    }

    fn usage(usd: Option<f64>) -> Usage {
        let tokens = Usage {
            input_tokens: 2_000_000,
            cached_tokens: 1_500_000,
            output_tokens: 10_000,
            ..Usage::default()
        };
        Usage { usd, ..tokens }
    }

    #[test]
    fn a_run_is_priced_by_recorded_tokens() {
        let prices = |options: &str| {
            let flags = AgentFlags::parse_policy(&format!("m?{options}")).unwrap();
            PolicyPrices::new(flags.prices(), &RobotModels::default())
        };
        let check = |used: &[&Usage], prices: &PolicyPrices, says: &str| {
            let told = in_words(30, used, prices);
            assert!(told.ends_with(says), "{told}");
        };
        let free = PolicyPrices::default();
        let uncached = "usd-per-million-input=2&usd-per-million-output=10";
        let (unpriced, priced) = (usage(None), usage(Some(3.0)));
        // Uncached input is 0.5 million tokens, cached input 1.5 million, and output 10,000: 1 + 0.3 + 0.1
        // dollars.
        let given = prices(&format!("{uncached}&usd-per-million-cached=0.2"));
        check(&[&priced, &unpriced], &given, "1.40 US dollars an episode, 42.00 for all");
        check(&[&unpriced], &prices(uncached), "4.10 US dollars an episode, 123.00 for all");
        check(&[&priced, &priced], &free, "3.00 US dollars an episode, 90.00 for all");
        check(
            &[&priced, &unpriced],
            &free,
            "give usd-per-million-input and usd-per-million-output with the model",
        );
        let told = in_words(30, &[&priced], &free);
        assert!(told.starts_with(
            "30 to play; in 1 recorded, models read 2000 thousand tokens an episode (1500 from"
        ));
    }

    #[test]
    fn no_episode_begins_that_may_pass_the_limit() {
        let limit = |most_usd: f64| SpendingLimit::new(Box::new(Nobody), Some(most_usd));
        let spend = |limit: &SpendingLimit, usd: f64| {
            limit.begin().expect("within the limit");
            limit.spent().under_way -= 1;
            limit.spent().add(Some(&usage(Some(usd))));
        };
        let run = limit(10.0);
        spend(&run, 4.0);
        spend(&run, 3.0);
        let refused = run.begin().unwrap_err().to_string();
        assert!(refused.contains("has cost 7.00") && refused.contains("--max-usd 10"), "{refused}");
        // Episodes that are being played may also cost as much as the most expensive one.
        let run = limit(10.0);
        spend(&run, 3.0);
        assert!(run.begin().is_ok() && run.begin().is_ok() && run.begin().is_err());
        assert!(limit(0.0).begin().is_err());
    }
}
