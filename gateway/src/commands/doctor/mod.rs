//! `tandem doctor`: checks whether a server's settings work on this machine, and advises on those that do
//! not.

mod around;
mod given;
mod machine;

use std::{fmt::Write, process::ExitCode};

use tandem_episodes::{EpisodeError, EpisodeSpec, SceneFile, build_world, tasks};
use tandem_tools_spec::Protocol;

use super::{CommandResult, print, serve::ServeArgs};
use crate::{settings::Layer, token::Token};

/// Check this machine: the files in a server's settings, physics, rendering, the port, the runs folder,
/// clocks and cores, and what other commands need: GPU, ffmpeg, Python, proxies, free space and the date.
#[derive(Debug, clap::Args)]
pub struct DoctorArgs {
    /// Settings of the server that is to run here.
    #[command(flatten)]
    serve: ServeArgs,
}

/// Result of a check.
#[derive(Debug, PartialEq)]
enum Finding {
    /// Success, with a description.
    Works(String),
    /// A note on a setting that may be unintended.
    Note(String),
    /// A failure, with advice.
    Wrong(String),
}

impl Finding {
    /// Converts a result to a finding.
    fn of(tried: Result<String, String>) -> Finding {
        tried.map_or_else(Finding::Wrong, Finding::Works)
    }
}

/// Findings, each with its subject.
type Findings = Vec<(&'static str, Finding)>;

/// Prints a line for each finding. The program fails if there is a failure.
pub fn run(args: DoctorArgs) -> CommandResult {
    let findings = examine(args.serve, Token::from_environment().map_err(|error| error.to_string()));
    print(&told(&findings))?;
    let sound = findings.iter().all(|(_, finding)| !matches!(finding, Finding::Wrong(_)));
    Ok(if sound { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn told(findings: &Findings) -> String {
    findings.iter().fold(String::new(), |mut lines, (what, finding)| {
        let (word, text) = match finding {
            Finding::Works(text) => ("ok", text),
            Finding::Note(text) => ("note", text),
            Finding::Wrong(text) => ("WRONG", text),
        };
        let text = text.trim_end().replace('\n', &format!("\n{:21}", ""));
        // Writing to a string cannot fail.
        let _ = writeln!(lines, "{what:14}{word:7}{text}");
        lines
    })
}

/// Runs all checks, even after failures.
fn examine(args: ServeArgs, token: Result<Option<Token>, String>) -> Findings {
    let mut findings = Findings::new();
    // As in the server, a token in the environment takes precedence over the token in the file.
    let flags = Layer { token: token.clone().ok().flatten(), ..args.flags };
    let layer = match &args.config {
        None => flags,
        Some(path) => match flags.clone().over_file(path) {
            Ok(layer) => {
                findings.push(("config", Finding::Works(format!("{} is read", path.display()))));
                layer
            }
            Err(error) => {
                findings.push(("config", Finding::Wrong(error.to_string())));
                let text = "what follows is of flags, environment and defaults alone";
                findings.push(("config", Finding::Note(text.into())));
                flags
            }
        },
    };
    findings.extend(given::check(&layer, token));
    findings.push(("renderer", Finding::of(layer.renderer().describe().map_err(|error| error.to_string()))));
    findings.extend(machine::check(&layer, specs(&layer).find(|spec| trial(spec).is_ok())));
    findings.extend(around::check(&layer));
    findings
}

/// Returns an episode of each benchmark task with this server's settings. Files that cannot be read are
/// ignored.
fn specs(layer: &Layer) -> impl Iterator<Item = EpisodeSpec> {
    let scene = layer.scene.as_deref().map(SceneFile::of);
    let scene = scene.and_then(Result::ok);
    let robot = layer.read_robot().unwrap_or_default();
    let (locomotion, sensing) = (layer.controller(), layer.sensing());
    let (renderer, camera) = (layer.renderer(), layer.camera());
    tasks::cohub().iter().map(move |task| EpisodeSpec {
        scene: scene.clone(),
        robot: robot.clone(),
        locomotion: locomotion.clone(),
        sensing,
        renderer,
        camera,
        ..EpisodeSpec::new(task, 0, Protocol::Benchmark)
    })
}

/// Builds the world of an episode. In a custom scene, this includes a second without commands, unless that
/// was tried before.
fn trial(spec: &EpisodeSpec) -> Result<(), EpisodeError> {
    build_world(spec).map(drop)
}

#[cfg(test)]
mod tests;
