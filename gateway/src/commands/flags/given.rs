//! The flags that the user has given, without defaults.

use std::collections::BTreeMap;

use clap::{ArgAction, ArgMatches, Args, Command, FromArgMatches, parser::ValueSource};

/// Flags of a subcommand that come from the command line or the environment: their values by id.
///
/// This has to be the first field of the subcommand's flags, because parsing another field removes its flags
/// from the matches.
#[derive(Debug)]
pub struct GivenFlags(BTreeMap<String, Vec<String>>);

impl GivenFlags {
    /// Returns the given flags that `A` has, each by its name on the command line. A switch has no value, and
    /// a repeated flag is returned once for each value.
    pub fn of<A: Args>(&self) -> Vec<(String, Option<String>)> {
        let command = A::augment_args(Command::new(""));
        let given = command.get_arguments().filter_map(|argument| {
            let texts = self.0.get(argument.get_id().as_str())?;
            let values = match (argument.get_action(), argument.get_value_delimiter()) {
                (ArgAction::SetTrue, _) => vec![None],
                (_, Some(_)) => vec![Some(texts.join(","))],
                (_, None) => texts.iter().cloned().map(Some).collect(),
            };
            let flag = argument.get_long()?.to_owned();
            Some(values.into_iter().map(move |value| (flag.clone(), value)))
        });
        given.flatten().collect()
    }
}

impl FromArgMatches for GivenFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<GivenFlags, clap::Error> {
        let is_given =
            |id: &&str| matches.value_source(id).is_some_and(|source| source != ValueSource::DefaultValue);
        let given = matches.ids().map(clap::Id::as_str).filter(is_given).filter_map(|id| {
            let texts = matches.get_raw(id)?.map(|text| text.to_string_lossy().into_owned());
            Some((id.to_owned(), texts.collect()))
        });
        Ok(GivenFlags(given.collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = GivenFlags::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for GivenFlags {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    #[command(no_binary_name = true)]
    struct Flags {
        #[command(flatten)]
        given: GivenFlags,
        #[arg(long, default_value = "0")]
        seeds: String,
        #[arg(long, default_value_t = 3)]
        most: u32,
        #[arg(long)]
        talk: bool,
        #[arg(long, value_delimiter = ',')]
        file: Vec<String>,
        #[arg(long)]
        model: Vec<String>,
    }

    #[test]
    fn defaults_are_not_given() {
        let given = |words: &[&str]| {
            let flags = Flags::parse_from(words);
            let given = flags.given.of::<Flags>().into_iter();
            let given =
                given.map(|(flag, value)| value.map_or(flag.clone(), |value| format!("{flag}={value}")));
            given.collect::<Vec<_>>()
        };
        assert!(given(&[]).is_empty());
        assert_eq!(given(&["--seeds", "0", "--talk"]), ["seeds=0", "talk"]);
        assert_eq!(given(&["--file", "a,b", "--most", "3"]), ["most=3", "file=a,b"]);
        assert_eq!(given(&["--model", "A=m,n", "--model", "B=o"]), ["model=A=m,n", "model=B=o"]);
    }
}
