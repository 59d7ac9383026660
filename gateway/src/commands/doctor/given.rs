//! Checks of the inputs that the settings name: limits, token, certificate, instructions, task files,
//! base controller, robot and scene.

use std::path::Path;

use tandem_episodes::{EpisodeError, RobotFile, SceneError, SceneFile};
use tandem_evaluation::check_robot;

use super::{Finding, Findings, specs, trial};
use crate::{
    settings::{Layer, read_task_file},
    token::Token,
};

/// Checks each input that `layer` names.
pub fn check(layer: &Layer, token: Result<Option<Token>, String>) -> Findings {
    let mut findings =
        vec![("limits", Finding::of(limits(layer))), ("token", Finding::of(check_token(layer, token)))];
    if layer.tls_cert.is_some() || layer.tls_key.is_some() {
        let read = layer.certificate().map_err(|error| error.to_string());
        findings.push(("tls", Finding::of(read.map(|_| "HTTPS is served with this certificate".into()))));
    }
    if let Some(path) = &layer.instructions {
        let tasks = layer.read_tasks().unwrap_or_default();
        let read = layer.read_instructions(&tasks).map_err(|error| error.to_string());
        findings.push(("instructions", Finding::of(read.map(|_| format!("{} is read", path.display())))));
    }
    for path in layer.task_file.iter().flatten() {
        let read = read_task_file(path).map_err(|error| error.to_string());
        findings.push((
            "task file",
            Finding::of(read.map(|task| format!("{} is read: {}", path.display(), task.id))),
        ));
    }
    if let Some(path) = &layer.locomotion {
        let loaded = layer.controller().load().map_err(|error| error.to_string());
        findings.push(("locomotion", Finding::of(loaded.map(|_| format!("{} is read", path.display())))));
    }
    if let Some(path) = &layer.robot {
        findings.extend(robot(layer, path).into_iter().map(|finding| ("robot", finding)));
    }
    if let Some(path) = &layer.scene {
        findings.extend(scene(layer, path).into_iter().map(|finding| ("scene", finding)));
    }
    findings
}

fn limits(layer: &Layer) -> Result<String, String> {
    layer.check().map_err(|error| error.to_string())?;
    Ok(format!("{} episodes at once", layer.max_episodes.unwrap_or(Layer::MAX_EPISODES)))
}

fn check_token(layer: &Layer, token: Result<Option<Token>, String>) -> Result<String, String> {
    token?;
    match layer.find_token() {
        Ok(Some(_)) => Ok("every request has to send it".into()),
        Ok(None) => Ok(format!("none, and none is needed: only this machine reaches {}", layer.address())),
        Err(error) => Err(error.to_string()),
    }
}

/// Reports the approximations in a robot's file, whether the robot stands, and the tasks that it can play.
fn robot(layer: &Layer, path: &Path) -> Vec<Finding> {
    let (robot, approximations) = match RobotFile::with_approximations(path) {
        Ok(read) => read,
        Err(error) => {
            let mut findings = vec![Finding::Wrong(error.to_string())];
            if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xml")) {
                let (file, out) = (path.display(), path.with_extension("toml"));
                let draft = format!("tandem robots new --from-model {file} {}", out.display());
                findings.push(Finding::Note(format!(
                    "a description says which joint is which; draft one by `{draft}`"
                )));
            }
            return findings;
        }
    };
    let mut findings: Vec<Finding> =
        approximations.iter().map(|line| Finding::Note(format!("not quite as in MuJoCo: {line}"))).collect();
    // The first task suffices to check for all ten that hands and controller fit.
    findings.push(Finding::Works(format!("{} is read", path.display())));
    match check_robot(&robot) {
        Ok(check) => {
            findings.extend(check.lacks.into_iter().map(Finding::Note));
            findings.push(
                check.falls.map_or_else(|| Finding::Works("it stands for a second".into()), Finding::Wrong),
            );
        }
        Err(error) => findings.push(Finding::Wrong(error.to_string())),
    }
    if let Some(Err(error @ EpisodeError::Robot(_))) = specs(layer).next().map(|spec| trial(&spec)) {
        findings.push(Finding::Note(error.to_string()));
    }
    findings
}

/// Reports the approximations in a scene's file, and the tasks that can be played in the scene. A scene is
/// made for a few tasks, so it is an error only if no task can be played.
fn scene(layer: &Layer, path: &Path) -> Vec<Finding> {
    let approximations = match SceneFile::with_approximations(path) {
        Ok((_, approximations)) => approximations,
        Err(error) => return vec![Finding::Wrong(error.to_string())],
    };
    let mut findings: Vec<Finding> =
        approximations.iter().map(|line| Finding::Note(format!("not quite as in MuJoCo: {line}"))).collect();
    let (mut playable, mut others) = (Vec::new(), Vec::new());
    for spec in specs(layer) {
        match trial(&spec) {
            Ok(()) => playable.push(spec.task.id.clone()),
            Err(error) => {
                let text = error.to_string();
                // Without the site for the task's origin, no task can be placed.
                if matches!(&error, EpisodeError::Scene(scene) if matches!(**scene, SceneError::NoPlace { .. }))
                {
                    findings.push(Finding::Wrong(format!("no task can be played: {text}")));
                    return findings;
                }
                others.push(Finding::Note(format!("{} cannot be played: {text}", spec.task.id)));
            }
        }
    }
    findings.push(match playable.is_empty() {
        true => Finding::Wrong(format!("no task can be played in {}; what each needs:", path.display())),
        false => Finding::Works(format!("{} holds {}", path.display(), playable.join(", "))),
    });
    findings.extend(others);
    findings
}
