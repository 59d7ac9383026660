//! `tandem collect --operators`: demonstrations of people, who drive in browsers.

use std::{
    error::Error,
    ffi::OsString,
    io::{IsTerminal, stdout},
    net::{Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
};

use clap::Args;
use tandem_episodes::tasks::Task;
use tandem_evaluation::evaluation::EvaluationPlan;

use crate::{
    commands::{evaluate::play_and_print, print},
    drivers::People,
    hosting::try_runs_folder,
    http::qr_text,
    settings::{Layer, Settings},
};

/// Port number that makes the system pick a free port.
const FREE_PORT: u16 = 0;

/// Time that an episode waits for its operators to begin, and to return.
const IDLE_S: u32 = 3600;

/// Flags for demonstrations of people.
#[derive(Debug, Args)]
pub struct PeopleFlags {
    /// Number of people to record in place of the experts; each drives one robot in a browser with a printed
    /// link.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=3))]
    operators: Option<u8>,
    /// With --operators: address of their pages, for example 0.0.0.0:8700 for people at other machines
    /// [default: 127.0.0.1 and a free port].
    #[arg(long, value_name = "ADDRESS", requires = "operators")]
    listen: Option<SocketAddr>,
    /// With --operators: name of this machine in the links [default: its address].
    #[arg(long, value_name = "HOST", requires = "operators")]
    allowed_host: Option<String>,
    /// With --operators: PEM file with a certificate, to serve their pages with HTTPS, as headsets require;
    /// needs --tls-key [default: none].
    #[arg(long, value_name = "FILE", requires = "operators")]
    tls_cert: Option<PathBuf>,
    /// With --operators: PEM file with the certificate's private key [default: none].
    #[arg(long, value_name = "FILE", requires = "operators")]
    tls_key: Option<PathBuf>,
}

impl PeopleFlags {
    /// Returns the number of people who drive, if there are any.
    pub fn operators(&self) -> Option<u8> {
        self.operators
    }

    /// Lets people play the episodes of `plan` that are not in `folder` yet. Episodes that are marked bad are
    /// moved to a folder beside it.
    pub fn collect(self, plan: EvaluationPlan, folder: &Path) -> Result<(), Box<dyn Error>> {
        let robots = robots_of(&plan.tasks, self.operators)?;
        let people = People::start(self.settings(&plan, folder)?, &robots, planned(&plan), aside(folder))?;
        print(&invitation(&people)?)?;
        let played = play_and_print(&EvaluationPlan { player: &people, jobs: 1, ..plan }, folder);
        people.dismiss();
        played.map(drop)
    }

    /// Returns the settings of a server that hosts only these episodes.
    fn settings(self, plan: &EvaluationPlan, folder: &Path) -> Result<Settings, Box<dyn Error>> {
        let listen = self.listen.unwrap_or(SocketAddr::from((Ipv4Addr::LOCALHOST, FREE_PORT)));
        let flags = Layer {
            // The address is set below, together with the token.
            allowed_host: self.allowed_host.map(|name| vec![name]),
            tls_cert: self.tls_cert,
            tls_key: self.tls_key,
            runs: Some(folder.into()),
            max_episodes: Some(1),
            idle_timeout: Some(IDLE_S),
            ..Layer::default()
        };
        let settings = Settings::resolve(flags, None)?;
        try_runs_folder(&settings.runs)?;
        Ok(Settings {
            listen,
            assistance: plan.assistance,
            disclosure: plan.disclosure,
            hints: plan.hints,
            base_limits: plan.locomotion.limits(&plan.robot)?,
            robot: plan.robot.clone(),
            locomotion: plan.locomotion.clone(),
            sensing: plan.sensing,
            renderer: plan.renderer,
            camera: plan.camera,
            ..(*settings).clone()
        })
    }
}

/// Returns the robots that all these tasks share, one for each of `operators`.
fn robots_of(tasks: &[Task], operators: Option<u8>) -> Result<Vec<&'static str>, String> {
    let wanted = usize::from(operators.unwrap_or_default());
    if let Some(task) = tasks.iter().find(|task| task.robots.len() != wanted) {
        let (id, robots) = (&task.id, task.robots.len());
        return Err(format!(
            "{id} has {robots} robots, and each has its person; give --operators {robots}, or --tasks with {wanted} robots"
        ));
    }
    Ok(tasks.first().map_or_else(Vec::new, |task| task.robot_names().collect()))
}

/// Lists the episodes of a plan, in order.
fn planned(plan: &EvaluationPlan) -> Vec<(String, u32)> {
    plan.episodes().0.iter().map(|spec| (spec.task.id.clone(), spec.seed)).collect()
}

/// Returns the folder for bad episodes. It is beside the folder of the run, so that no data set includes
/// them.
fn aside(folder: &Path) -> PathBuf {
    let mut name = folder.file_name().map_or_else(OsString::new, OsString::from);
    name.push("-bad");
    folder.with_file_name(name)
}

/// Returns the links, each with a QR code if the output is a terminal.
fn invitation(people: &People) -> Result<String, Box<dyn Error>> {
    let mut text = String::new();
    for (robot, link) in people.links() {
        text += &format!("robot {robot}: {link}\n");
        if stdout().is_terminal() {
            text += &format!("{}\n", qr_text(&link)?);
        }
    }
    text += &format!("all links: {}\n", people.overview_link());
    text += &format!("watch at {}\n", people.watch_link());
    Ok(text)
}

#[cfg(test)]
mod tests {
    use tandem_episodes::tasks;

    use super::*;

    #[test]
    fn each_robot_has_a_person() {
        let of = |ids: &[&str], operators| {
            let tasks: Vec<_> = ids.iter().map(|id| tasks::find(id).unwrap()).collect();
            robots_of(&tasks, Some(operators))
        };
        assert_eq!(of(&["handover", "pouring"], 2).unwrap(), ["A", "B"]);
        assert_eq!(of(&["move_house"], 3).unwrap(), ["A", "B", "C"]);
        let refused = of(&["handover", "move_house"], 2).unwrap_err();
        assert!(
            refused.contains("move_house has 3 robots") && refused.contains("--operators 3"),
            "{refused}"
        );
    }

    #[test]
    fn bad_ones_are_beside_the_folder() {
        assert_eq!(aside(Path::new("runs/people")), Path::new("runs/people-bad"));
        assert_eq!(aside(Path::new("people")), Path::new("people-bad"));
    }
}
