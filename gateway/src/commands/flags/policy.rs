//! The flags for the choice of a policy: a built-in player, a program, or a learned policy at a server.

use std::{error::Error, path::PathBuf, sync::Arc, time::Duration};

use tandem_episodes::{EpisodeSpec, players};
use tandem_evaluation::{
    policies::{EpisodeOutput, OpenLoop, PartnerPolicy, PlayError, PlayOutcome, Policy, PolicyWait},
    results::PolicyCard,
};
use tandem_policies::{PRESETS, PolicyKey, PolicyMap, PolicyProtocol, RemotePolicy};
use tandem_tools_spec::{Driving, Operators};

use super::agent::AgentFlags;
use super::robot_models::{PolicyPrices, RobotModels};
use crate::drivers::{Program, PythonModule, PythonPart};

/// Prefix of --policy that names a program.
const EXEC: &str = "exec:";

/// Prefix of --policy that names a language model.
const AGENT: &str = "agent:";

/// Prefix of --policy that names recordings.
const OPEN_LOOP: &str = "open-loop:";

/// Default time limit of a program in an episode.
const LIMIT_S: u32 = 3600;

/// Flags for the choice of a policy.
#[derive(Debug, clap::Args)]
pub struct PolicyFlags {
    #[arg(long, value_name = "POLICY", default_value = "expert", value_parser = parse_policy, help = help())]
    policy: PolicyChoice,
    /// Policy map for a policy at a server: a preset (openpi, xpolicylab or gr00t_n17_g1) or a TOML file
    /// [default: openpi for openpi:, xpolicylab for xpolicylab:, none for act:].
    #[arg(long, value_name = "NAME|FILE")]
    policy_map: Option<String>,
    /// File with the key for the policy's server, sent as `Authorization` (openpi, xpolicylab: `Api-Key KEY`;
    /// act: `Bearer KEY`; a key that names its scheme, such as `Basic ...`, unchanged), only over wss:// and
    /// https:// or to this machine; the environment variable TANDEM_POLICY_KEY can hold the key itself
    /// [default: none].
    #[arg(long, value_name = "FILE")]
    policy_key_file: Option<PathBuf>,
    /// Time limit of a program in one episode [default: 3600].
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..))]
    policy_limit: Option<u32>,
    /// Start one program per robot, which sees and commands only that robot.
    #[arg(long)]
    per_robot: bool,
    /// With --per-robot: let the programs talk to each other with the tool `say`.
    #[arg(long, requires = "per_robot")]
    talk: bool,
    /// With --per-robot: time that the others wait for a missing command before its robot holds still
    /// [default: 120].
    #[arg(long = "patience", value_name = "SECONDS", requires = "per_robot")]
    patience_s: Option<f64>,
    #[command(flatten)]
    robot_models: RobotModels,
    /// Name of the policy in results and reports, instead of the text of --policy.
    #[arg(long, value_name = "NAME")]
    policy_name: Option<String>,
}

/// A policy given on the command line.
#[derive(Clone, Debug)]
enum PolicyChoice {
    Player(&'static players::PlayerEntry),
    Program(String),
    Agent(Box<AgentFlags>),
    OpenLoop(PathBuf),
    Remote(PolicyProtocol, Vec<String>),
}

fn help() -> String {
    let players = players::ALL.iter().map(|player| format!("{} ({})", player.name, player.about));
    let players: Vec<String> = players.collect();
    format!(
        "Who plays: {}; open-loop:RECORDING, what the robots of a demonstration of another seed were told, replayed without a look \
         (an episode.mcap, or a folder that `collect` wrote); exec:COMMAND, a program that is started anew for every episode; \
         agent:MODEL, a language model, with flags of `tandem agent` as in agent:MODEL?api=anthropic&max-usd=2; openpi:ws://HOST:PORT, \
         xpolicylab:ws://HOST:PORT or act:http://HOST:PORT/act, a learned policy at a server, or one for each robot, separated by commas",
        players.join(", ")
    )
}

fn parse_policy(text: &str) -> Result<PolicyChoice, String> {
    if let Some(command) = text.strip_prefix(EXEC) {
        return match command.trim().is_empty() {
            true => Err("no command; give one, for example exec:\"python3 agent.py\"".into()),
            false => Ok(PolicyChoice::Program(command.into())),
        };
    }
    if let Some(agent) = text.strip_prefix(AGENT) {
        return AgentFlags::parse_policy(agent).map(|flags| PolicyChoice::Agent(Box::new(flags)));
    }
    if let Some(path) = text.strip_prefix(OPEN_LOOP) {
        return match path.is_empty() {
            true => Err("no recording; give one, for example open-loop:runs/demonstrations".into()),
            false => Ok(PolicyChoice::OpenLoop(path.into())),
        };
    }
    for protocol in PolicyProtocol::ALL {
        if let Some(urls) = text.strip_prefix(&format!("{protocol}:")) {
            return parse_urls(protocol, urls).map(|urls| PolicyChoice::Remote(protocol, urls));
        }
    }
    players::find(text).map(PolicyChoice::Player).map_err(|error| {
        format!(
            "{error}, exec:COMMAND, agent:MODEL, openpi:ws://HOST:PORT, xpolicylab:ws://HOST:PORT, act:http://HOST:PORT/act, \
             open-loop:RECORDING"
        )
    })
}

fn parse_urls(protocol: PolicyProtocol, urls: &str) -> Result<Vec<String>, String> {
    let schemes = protocol.schemes();
    let [plain, encrypted] = schemes;
    let check = |url: &str| {
        let url = url.trim();
        let behind = schemes.iter().find_map(|scheme| url.strip_prefix(scheme));
        match behind.filter(|rest| !rest.is_empty() && !rest.starts_with(['/', ':'])) {
            Some(rest) if rest.split('/').next().is_some_and(|authority| authority.contains('@')) => {
                Err("an address takes no key; give it by --policy-key-file or TANDEM_POLICY_KEY".into())
            }
            // The default port of the web is never the port of a policy's server.
            Some(_) if plain == "ws://" && url.starts_with(plain) && port_of(url).is_none() => {
                Err(format!("{url:?} names no port; give {protocol}:{plain}HOST:PORT"))
            }
            Some(_) => Ok(url.to_owned()),
            None => Err(format!(
                "{url:?} is no address of a server; give {protocol}:{plain}HOST:PORT, or {protocol}:{encrypted}HOST for an encrypted one"
            )),
        }
    };
    urls.split(',').map(check).collect()
}

/// Returns the port in a URL.
fn port_of(url: &str) -> Option<u16> {
    let authority = url.split_once("://")?.1.split('/').next()?;
    authority.rsplit_once(']').map_or(authority, |(_, behind)| behind).rsplit_once(':')?.1.parse().ok()
}

impl PolicyFlags {
    /// Returns the prices that the flags of a language model give; `None` for other policies.
    pub fn prices(&self) -> Option<PolicyPrices> {
        match &self.policy {
            PolicyChoice::Agent(flags) => Some(PolicyPrices::new(flags.prices(), &self.robot_models)),
            PolicyChoice::Player(_)
            | PolicyChoice::Program(_)
            | PolicyChoice::OpenLoop(_)
            | PolicyChoice::Remote(..) => None,
        }
    }

    /// Creates the policy and reads its inputs. No server is contacted yet.
    pub fn policy(self) -> Result<Box<dyn Policy>, Box<dyn Error>> {
        let misplaced = |flag: &str, who: &str| Err(format!("{flag} is for {who}").into());
        let driving = self.driving()?;
        let (key_file, robots) = (self.policy_key_file, self.robot_models);
        if !robots.is_empty() && !matches!(self.policy, PolicyChoice::Agent(_)) {
            return misplaced("--robot-model", "language models, for example agent:MODEL");
        }
        if key_file.is_some() && !matches!(self.policy, PolicyChoice::Remote(..)) {
            return misplaced("--policy-key-file", "policies at a server");
        }
        let policy: Box<dyn Policy> = match (self.policy, self.policy_map, self.policy_limit) {
            (
                PolicyChoice::Player(_)
                | PolicyChoice::OpenLoop(_)
                | PolicyChoice::Program(_)
                | PolicyChoice::Agent(_),
                Some(_),
                _,
            ) => {
                return misplaced("--policy-map", "policies at a server");
            }
            (PolicyChoice::Player(_) | PolicyChoice::OpenLoop(_) | PolicyChoice::Remote(..), _, Some(_)) => {
                return misplaced("--policy-limit", "programs");
            }
            (PolicyChoice::Player(_) | PolicyChoice::OpenLoop(_) | PolicyChoice::Remote(..), _, None)
                if driving.is_per_robot() =>
            {
                return misplaced(
                    "--per-robot",
                    "programs; a policy at a server has one address for each robot",
                );
            }
            (PolicyChoice::Player(entry), None, None) => Box::new(BuiltIn(entry)),
            (PolicyChoice::OpenLoop(path), None, None) => Box::new(OpenLoop::read(&path)?),
            (PolicyChoice::Program(command), None, limit_s) => {
                let limit = Duration::from_secs(limit_s.unwrap_or(LIMIT_S).into());
                Box::new(Program::new(command, driving, limit)?)
            }
            (PolicyChoice::Agent(flags), None, limit_s) => {
                let limit_s = limit_s.unwrap_or_else(|| robots.limit_s(flags.limit_s(LIMIT_S)));
                Box::new(agent(&flags, &robots, driving, limit_s)?)
            }
            (PolicyChoice::Remote(protocol, urls), map, None) => Box::new(
                remote_policy(protocol, urls, map, "--policy-map")?
                    .with_key(PolicyKey::find(key_file.as_deref())?)?,
            ),
        };
        Ok(match self.policy_name {
            Some(name) => Box::new(Renamed { name, policy }),
            None => policy,
        })
    }

    fn driving(&self) -> Result<Driving, String> {
        let operators = self.per_robot.then_some(Operators::PerRobot);
        let driving = Driving { operators, patience_s: self.patience_s, talk: self.talk.then_some(true) };
        driving.validate().map(|()| driving)
    }
}

/// Creates the policy of one language model, or of several.
fn agent(
    flags: &AgentFlags,
    robots: &RobotModels,
    driving: Driving,
    limit_s: u32,
) -> Result<Program, Box<dyn Error>> {
    let arguments = flags.arguments(limit_s).into_iter().chain(robots.arguments());
    let agent = PythonModule::new(PythonPart::Agent, arguments.collect())?;
    let mut card = flags.card();
    if let Some(cards) = robots.cards() {
        card["robots"] = cards;
    }
    let name = format!("{AGENT}{}{}", flags.model(), robots.name());
    Ok(Program::agent(&agent, name, card, driving, Duration::from_secs(limit_s.into()))?)
}

/// Creates the policy at `urls` with the map that `flag` gives, or else with the protocol's default map.
fn remote_policy(
    protocol: PolicyProtocol,
    urls: Vec<String>,
    map: Option<String>,
    flag: &str,
) -> Result<RemotePolicy, Box<dyn Error>> {
    let Some(map) = map.or(protocol.preset().map(str::to_owned)) else {
        let presets = PRESETS.map(|(name, _)| name).join(", ");
        return Err(format!("{protocol}: needs {flag}, a file or one of {presets}").into());
    };
    Ok(RemotePolicy::new(protocol, urls, PolicyMap::find(&map)?))
}

/// The flags of a policy that may drive one robot beside people.
#[derive(Debug, Default, clap::Args)]
pub struct PartnerFlags {
    /// Learned policy at a server that can drive a robot beside people on /operate: openpi:ws://HOST:PORT,
    /// xpolicylab:ws://HOST:PORT or act:http://HOST:PORT/act, as in `evaluate --policy` [default: none].
    #[arg(long, env = "TANDEM_PARTNER", value_name = "POLICY", value_parser = parse_partner)]
    partner: Option<PartnerAddress>,
    /// Policy map of that policy, as in `evaluate --policy-map`.
    #[arg(long, env = "TANDEM_PARTNER_MAP", value_name = "NAME|FILE", requires = "partner")]
    partner_map: Option<String>,
    /// File with the key for its server, as in `evaluate --policy-key-file`; the environment variable
    /// TANDEM_POLICY_KEY can hold the key itself.
    #[arg(long, env = "TANDEM_PARTNER_KEY_FILE", value_name = "FILE", requires = "partner")]
    partner_key_file: Option<PathBuf>,
}

#[derive(Clone, Debug)]
struct PartnerAddress(PolicyProtocol, Vec<String>);

fn parse_partner(text: &str) -> Result<PartnerAddress, String> {
    match parse_policy(text)? {
        PolicyChoice::Remote(protocol, urls) => Ok(PartnerAddress(protocol, urls)),
        PolicyChoice::Player(_) | PolicyChoice::Program(_) | PolicyChoice::Agent(_) | PolicyChoice::OpenLoop(_) => Err(
            "a partner is a policy at a server, for example act:http://127.0.0.1:8500/act; people choose experts and programs on /operate without a flag"
                .into(),
        ),
    }
}

impl PartnerFlags {
    /// Creates the policy if there is one, and reads its inputs. No server is contacted yet.
    pub fn policy(self) -> Result<Option<Arc<dyn PartnerPolicy>>, Box<dyn Error>> {
        let Some(PartnerAddress(protocol, urls)) = self.partner else { return Ok(None) };
        let policy = remote_policy(protocol, urls, self.partner_map, "--partner-map")?;
        Ok(Some(Arc::new(policy.with_key(PolicyKey::find(self.partner_key_file.as_deref())?)?)))
    }
}

/// A built-in player.
#[derive(Debug)]
struct BuiltIn(&'static players::PlayerEntry);

impl Policy for BuiltIn {
    fn card(&self) -> PolicyCard {
        self.0.card()
    }

    fn play_episode(&self, spec: &EpisodeSpec, output: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        self.0.play_episode(spec, output)
    }
}

/// A policy with a different name.
#[derive(Debug)]
struct Renamed {
    name: String,
    policy: Box<dyn Policy>,
}

impl Policy for Renamed {
    fn card(&self) -> PolicyCard {
        PolicyCard { name: self.name.clone(), ..self.policy.card() }
    }

    fn play_episode(&self, spec: &EpisodeSpec, output: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        self.policy.play_episode(spec, output)
    }

    fn waiting(&self) -> Option<PolicyWait> {
        self.policy.waiting()
    }

    fn is_interrupted(&self) -> bool {
        self.policy.is_interrupted()
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        flags: PolicyFlags,
    }

    fn card(flags: &[&str]) -> Result<PolicyCard, String> {
        let line = Line::try_parse_from([&["tandem"], flags].concat()).map_err(|error| error.to_string())?;
        line.flags.policy().map(|policy| policy.card()).map_err(|error| error.to_string())
    }

    #[test]
    fn policies_are_named_by_what_they_are() {
        assert_eq!(card(&[]), Ok("expert".into()));
        let remote = card(&["--policy", "openpi:ws://a:1,ws://b:2"]).unwrap();
        assert_eq!(remote.name, "openpi:ws://a:1,ws://b:2");
        let gr00t = card(&["--policy", "openpi:ws://a:1,ws://b:2", "--policy-map", "gr00t_n17_g1"]).unwrap();
        assert!(gr00t.name == remote.name && gr00t.settings != remote.settings);
        let program = card(&["--policy", "exec:true", "--policy-name", "mine"]).unwrap();
        assert_eq!((&*program.name, &program.settings.unwrap()["command"]), ("mine", &"true".into()));
        let each = card(&["--policy", "exec:true", "--per-robot", "--talk"]).unwrap();
        assert_eq!((&*each.name, &each.settings.unwrap()["talk"]), ("exec:true per robot", &true.into()));
    }

    #[test]
    fn what_is_no_policy_is_told_what_is() {
        let check = |flags: &[&str], says: &str| {
            let refusal = card(flags).unwrap_err();
            assert!(refusal.contains(says), "{refusal}");
        };
        check(&["--policy", "expart"], "have: expert, no_words, idle, demonstration, exec:COMMAND");
        check(&["--policy", "exec: "], "give one, for example exec:");
        check(&["--policy", "open-loop:"], "give one, for example open-loop:runs/demonstrations");
        check(
            &["--policy", "open-loop:nowhere/episode.mcap"],
            "cannot read the recording nowhere/episode.mcap",
        );
        check(&["--policy", "open-loop:src"], "src holds no recording of an episode; give an episode.mcap");
        check(&["--policy", "open-loop:src", "--per-robot"], "--per-robot is for programs");
        check(&["--policy", "agent:?api=openai"], "give one, for example agent:MODEL");
        check(
            &["--policy", "agent:m?key=1"],
            "unexpected argument '--key' found; an option of agent: is one of api, base-url",
        );
        check(&["--policy", "agent:m?api=grpc"], "openai, openai-chat, anthropic");
        check(&["--policy", "agent:m?max-calls=0"], "max-calls");
        check(&["--policy", "agent:m", "--policy-map", "openpi"], "--policy-map is for policies at a server");
        check(
            &["--policy", "openpi:http://a"],
            "give openpi:ws://HOST:PORT, or openpi:wss://HOST for an encrypted one",
        );
        check(&["--policy", "openpi:ws://a"], "names no port; give openpi:ws://HOST:PORT");
        check(&["--policy", "xpolicylab:ws://[::1]"], "names no port");
        check(&["--policy", "act:https://:1/act"], "is no address of a server");
        check(&["--policy", "openpi:wss://key@a"], "an address takes no key; give it by --policy-key-file");
        check(&["--policy-key-file", "key"], "--policy-key-file is for policies at a server");
        check(
            &["--policy", "openpi:wss://a", "--policy-key-file", "nothing.txt"],
            "cannot read the policy's key in nothing.txt",
        );
        check(
            &["--policy", "openpi:ws://a.example:1", "--policy-key-file", "Cargo.toml"],
            "has to be one line",
        );
        check(
            &["--policy", "act:http://a/act"],
            "act: needs --policy-map, a file or one of openpi, xpolicylab, gr00t_n17_g1",
        );
        check(
            &["--policy", "openpi:ws://a:1", "--policy-map", "nothing.toml"],
            "no policy map \"nothing.toml\"",
        );
        check(&["--policy-map", "openpi"], "--policy-map is for policies at a server");
        check(&["--policy-limit", "5"], "--policy-limit is for programs");
        check(&["--per-robot"], "--per-robot is for programs");
        check(&["--per-robot", "--robot-model", "A=m"], "--robot-model is for language models");
        check(&["--policy", "exec:true", "--talk"], "--per-robot");
        check(&["--policy", "exec:true", "--per-robot", "--patience", "0"], "give 0.05 to 600 seconds");
    }

    #[test]
    fn a_partner_is_a_policy_at_a_server() {
        #[derive(Debug, Parser)]
        struct Serve {
            #[command(flatten)]
            flags: PartnerFlags,
        }
        let partner = |flags: &[&str]| {
            let line =
                Serve::try_parse_from([&["serve"], flags].concat()).map_err(|error| error.to_string())?;
            let policy = line.flags.policy().map_err(|error| error.to_string())?;
            Ok::<_, String>(policy.map(|policy| policy.name()))
        };
        assert_eq!(partner(&[]), Ok(None));
        assert_eq!(partner(&["--partner", "openpi:ws://a:1"]), Ok(Some("openpi:ws://a:1".into())));
        let check = |flags: &[&str], says: &str| {
            let refusal = partner(flags).unwrap_err();
            assert!(refusal.contains(says), "{refusal}");
        };
        check(&["--partner", "act:http://a/act"], "act: needs --partner-map, a file or one of openpi");
        check(&["--partner", "expert"], "a partner is a policy at a server, for example act:http://");
        check(&["--partner", "exec:true"], "a partner is a policy at a server");
        check(&["--partner-map", "openpi"], "--partner");
    }
}
