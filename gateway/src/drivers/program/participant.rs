//! The inputs of one program of an episode: its folder, its environment and its brief.
//!
//! The brief describes the task and the interface in text that can be given to a language model directly.

use std::{env, fs, io, path::Path};

use tandem_episodes::{EpisodeError, OutputError, create_private_folder, write_whole};
use tandem_evaluation::policies::PlayError;
use tandem_tools_spec::{Driving, StartReply};
use tempfile::TempDir;

use super::process::{BRIEF_FILE, STDERR_FILE, STDOUT_FILE};
use crate::drivers::lost;

/// File with the server's reply to the start, for programs that read JSON.
const START_FILE: &str = "start.json";

/// File of a language model's conversation, which Python writes beside [`START_FILE`].
const CONVERSATION_FILE: &str = "agent.jsonl";

/// A program that controls all robots, or one robot.
#[derive(Debug)]
pub struct Participant<'a> {
    /// Robot that the program controls; `None` if it controls all robots.
    pub robot: Option<&'a str>,
    token: &'a str,
    /// Folder of the program's brief and output while it runs. The name is neutral, and the folders of other
    /// programs and episodes are elsewhere.
    pub folder: TempDir,
}

impl<'a> Participant<'a> {
    /// Creates the programs of the episode `start`: one program with the server's own `token`, or one for
    /// each operator.
    pub fn all(start: &'a StartReply, token: &'a str) -> Result<Vec<Participant<'a>>, PlayError> {
        let participant = |robot: Option<&'a str>, token: &'a str| {
            let folder = private_folder().map_err(|error| lost("no folder for a program", error))?;
            Ok(Participant { robot, token, folder })
        };
        if start.operators.is_empty() {
            return Ok(vec![participant(None, token)?]);
        }
        start.operators.iter().map(|own| participant(Some(&own.robot), &own.token)).collect()
    }

    /// Writes the input files of the program.
    pub fn write(&self, start: &StartReply, url: &str, driving: &Driving) -> Result<(), EpisodeError> {
        // A program receives only its own token, and no token is written to a file.
        let own = |robot: &str| start.briefing.clone().for_robot(robot);
        let briefing = self.robot.map_or_else(|| start.briefing.clone(), own);
        let shown = StartReply { operators: Vec::new(), briefing, ..start.clone() };
        let text = brief(&shown, url, self.robot, driving);
        write_whole(&self.folder.path().join(BRIEF_FILE), text.as_bytes())?;
        let text = serde_json::to_string_pretty(&shown).map_err(OutputError::from)?;
        Ok(write_whole(&self.folder.path().join(START_FILE), text.as_bytes())?)
    }

    /// Copies the program's inputs and output to the folder of its episode after its end. Links that the
    /// program has put in place of these files are not followed.
    pub fn keep_files(&self, episode: &Path) -> io::Result<()> {
        let kept = self.robot.map_or_else(|| episode.to_owned(), |robot| episode.join(robot));
        create_private_folder(&kept)?;
        for name in [BRIEF_FILE, START_FILE, STDOUT_FILE, STDERR_FILE, CONVERSATION_FILE] {
            let (from, to) = (self.folder.path().join(name), kept.join(name));
            if !fs::symlink_metadata(&from).is_ok_and(|found| found.is_file()) {
                continue;
            }
            match fs::remove_file(&to) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => drop(fs::copy(&from, &to)?),
            }
        }
        Ok(())
    }

    /// Returns the variables that are added to the program's environment.
    pub fn environment(&self, start: &StartReply, url: &str) -> Vec<(&'static str, String)> {
        let common = [
            ("TANDEM_URL", url.into()),
            ("TANDEM_EPISODE", start.episode_id.clone()),
            ("TANDEM_TOKEN", self.token.into()),
            ("TANDEM_START", self.folder.path().join(START_FILE).display().to_string()),
        ];
        let robot = self.robot.map(|robot| ("TANDEM_ROBOT", robot.into()));
        common.into_iter().chain(robot).chain(off_proxies()).collect()
    }
}

/// Creates a folder that no other user may enter. Dropping it removes it.
fn private_folder() -> io::Result<TempDir> {
    let mut builder = tempfile::Builder::new();
    builder.prefix("tandem-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
    builder.tempdir()
}

/// Hosts that are reached without a proxy.
const LOOPBACK: [&str; 3] = ["127.0.0.1", "localhost", "::1"];

/// Returns variables that exempt this machine from proxies, in addition to existing exceptions.
fn off_proxies() -> [(&'static str, String); 2] {
    ["NO_PROXY", "no_proxy"].map(|name| {
        let known = env::var(name).unwrap_or_default();
        let mut hosts: Vec<&str> = known.split(',').map(str::trim).filter(|host| !host.is_empty()).collect();
        hosts.extend(LOOPBACK);
        (name, hosts.join(","))
    })
}

/// Writes the brief for the episode `start` on the server at `url`, for a reader that controls all
/// robots, or only `robot`.
fn brief(start: &StartReply, url: &str, robot: Option<&str>, driving: &Driving) -> String {
    let StartReply { episode_id: id, briefing, .. } = start;
    let mut paragraphs = vec![addressee(start, robot), format!("Task: {}", briefing.instruction)];
    let told = briefing.instructions.iter();
    paragraphs.extend(told.map(|entry| format!("Robot {}: {}", entry.robot, entry.instruction)));
    paragraphs.extend(robot.map(|_| partners(driving)));
    paragraphs.push(format!(
        "Tools: over MCP at {url}/mcp, each with the argument episode_id {id:?}; or by HTTP, POST {url}/v1/episodes/{id}/tools/NAME \
         with JSON. GET {url}/v1/episodes/{id}/tools describes each of them and the JSON that it takes. Every request has the header \
         Authorization: Bearer TOKEN, with the token in the environment's TANDEM_TOKEN."
    ));
    let budget = &briefing.status.budget;
    let clock = match budget.wall_clock_left_s {
        Some(left_s) => format!("{left_s:.0} seconds to think between calls"),
        None => "as much time to think as you like".into(),
    };
    paragraphs.push(format!(
        "Budget: {} control steps of 20 ms, at most {} in one command; {clock}. {} Call finish, too, when the task cannot be done.",
        budget.steps_left, budget.steps_per_command, briefing.ending
    ));
    paragraphs.extend(briefing.brief.lines());
    paragraphs.join("\n\n") + "\n"
}

/// Describes the robots that the reader controls.
fn addressee(start: &StartReply, robot: Option<&str>) -> String {
    let StartReply { episode_id: id, briefing, .. } = start;
    let names = briefing.robots.iter().map(|robot| robot.robot.as_str());
    let (directed, others): (Vec<&str>, Vec<&str>) =
        names.partition(|name| robot.is_none_or(|robot| robot == *name));
    let whom = match robot {
        None => format!("humanoid robots {}", directed.join(", ")),
        Some(robot) => format!("humanoid robot {robot}"),
    };
    let others = match others.is_empty() {
        true => String::new(),
        false => {
            format!(" Others direct {}, one each; you see and command your own alone.", others.join(", "))
        }
    };
    format!(
        "You direct the {whom} in the episode {id:?} on a Tandem server. The episode has begun; you need no other.{others}"
    )
}

/// Describes how programs that each control one robot act together.
fn partners(driving: &Driving) -> String {
    let talk = match driving.talk {
        Some(true) => " You may talk to the others with the tool say; what they say comes with your replies.",
        _ => "",
    };
    format!(
        "A command is executed when every robot has one, and the shortest ends them all; a robot whose director keeps silent for {} \
         seconds holds still meanwhile.{talk}",
        driving.patience_s()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_proxy_leads_to_this_machine() {
        for (name, hosts) in off_proxies() {
            assert!(name.eq_ignore_ascii_case("no_proxy"), "{name}");
            let hosts: Vec<&str> = hosts.split(',').collect();
            assert!(LOOPBACK.iter().all(|host| hosts.contains(host)), "{hosts:?}");
        }
    }
}
