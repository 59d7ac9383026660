//! Header of a report: the command that has created it, the settings of each policy, and the processes that
//! have played the episodes.

use std::time::SystemTime;

use serde::Serialize;
use tandem_episodes::tasks;
use tandem_tools_spec::{Assistance, Protocol};

use super::load::FolderProcess;
use super::policy::PolicyGroup;
use crate::reports::table::{NONE, Table};
use crate::results::{PlayedEpisode, SeedList, command_line, utc_text};

/// Origin of a report and of its episodes.
#[derive(Debug, Serialize)]
pub struct ReportHeader {
    /// `None` if the report was not created by a command.
    pub made: Option<ReportOrigin>,
    /// Settings of each policy, in the order of the report's policies.
    pub settings: Vec<RunSettings>,
    /// Processes that have played in the folders. Earlier builds and servers do not record theirs.
    pub processes: Vec<FolderProcess>,
}

/// Command, build and time of a report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReportOrigin {
    pub command: String,
    /// Version and fingerprint of the program.
    pub build: String,
    /// Time in UTC.
    pub written_at: String,
}

/// Settings of a policy's episodes.
#[derive(Debug, Serialize)]
pub struct RunSettings {
    pub policy: String,
    pub tasks: Vec<String>,
    /// Seeds of all tasks together.
    pub seeds: SeedList,
    /// Number of episodes that count.
    pub episodes: usize,
    pub protocol: Protocol,
    pub assistance: Assistance,
    /// Name of the robots' base controller.
    pub controller: String,
    /// Renderers that were requested.
    pub renderers: Vec<String>,
    /// Model of the robots' cameras.
    pub camera: &'static str,
    pub state_estimate: &'static str,
    pub sensors: &'static str,
    pub build: String,
    /// Times at which the first and the last episode ended, in UTC; `None` if no result states them.
    pub ended_at: Option<[String; 2]>,
}

impl ReportOrigin {
    /// Describes the origin of a report that this process creates now.
    pub fn here(build: &str) -> ReportOrigin {
        ReportOrigin { command: command_line(), build: build.into(), written_at: utc_text(SystemTime::now()) }
    }

    /// Describes the origin in a sentence with code in backticks.
    pub fn in_words(&self) -> String {
        let ReportOrigin { command, build, written_at } = self;
        format!("Made by `{command}` at {written_at}, build `{build}`.")
    }
}

impl RunSettings {
    /// Returns the settings of a group; `None` if it has no episodes.
    pub fn of(group: &PolicyGroup) -> Option<RunSettings> {
        let played: Vec<&PlayedEpisode> = group.all().collect();
        let first = played.first()?;
        let spec = &first.spec;
        let mut renderers: Vec<String> = Vec::new();
        for played in &played {
            let name = played.spec.renderer.name();
            if !renderers.iter().any(|known| known == name) {
                renderers.push(name.into());
            }
        }
        let order = tasks::in_order(played.iter().map(|played| &played.spec.task));
        Some(RunSettings {
            policy: group.name.clone(),
            tasks: order.into_iter().map(|task| task.id.clone()).collect(),
            seeds: SeedList(played.iter().map(|played| played.spec.seed).collect()),
            episodes: group.episodes.len(),
            protocol: spec.protocol,
            assistance: spec.assistance,
            controller: first.locomotion.clone(),
            renderers,
            camera: spec.camera.name(),
            state_estimate: spec.sensing.state_estimate.name(),
            sensors: spec.sensing.sensors.name(),
            build: first.build.clone(),
            ended_at: ended_between(&played),
        })
    }
}

/// Returns the times at which the first and the last of these episodes ended; `None` if no result states
/// them.
pub fn ended_between(played: &[&PlayedEpisode]) -> Option<[String; 2]> {
    // Times in the same format sort like their texts.
    let times = || played.iter().filter_map(|played| played.ended_at.clone());
    Some([times().min()?, times().max()?])
}

/// Formats a time span as one or two dates, for example `2026-11-28`.
pub fn days([first, last]: &[String; 2]) -> String {
    let day = |time: &str| time.split('T').next().unwrap_or_default().to_owned();
    let (first, last) = (day(first), day(last));
    if first == last { first } else { format!("{first} to {last}") }
}

/// Lists the settings of each policy.
pub fn settings(header: &ReportHeader) -> Table {
    let mut table = Table::new(
        "Settings",
        "Episodes that count, and how they were played. `auto` is the renderer that the machine has; days are \
         in UTC.",
        &[
            "Policy",
            "Tasks",
            "Seeds",
            "Protocol",
            "Assistance",
            "Controller",
            "Renderer",
            "Camera",
            "State",
            "Sensors",
            "Build",
            "Played",
            "Episodes",
        ],
        12,
    );
    table.rows.extend(header.settings.iter().map(|of| {
        vec![
            of.policy.clone(),
            of.tasks.join(", "),
            of.seeds.clone().into(),
            of.protocol.name().into(),
            of.assistance.name().into(),
            of.controller.clone(),
            of.renderers.join(", "),
            of.camera.into(),
            of.state_estimate.into(),
            of.sensors.into(),
            of.build.clone(),
            of.ended_at.as_ref().map_or(NONE.into(), days),
            of.episodes.to_string(),
        ]
    }));
    table
}

/// Lists the processes that have played, with their machines.
pub fn processes(header: &ReportHeader) -> Table {
    let mut table = Table::new(
        "Commands and machines",
        "Processes that have played in these folders, by their beginning in UTC.",
        &["Folder", "Command", "Begun", "Build", "System", "Processor", "Cores"],
        6,
    );
    table.rows.extend(header.processes.iter().map(|FolderProcess { folder, process }| {
        let machine = &process.machine;
        vec![
            folder.clone(),
            process.command.clone(),
            process.begun_at.clone(),
            process.build.clone(),
            format!("{}, {}", machine.os, machine.architecture),
            machine.cpu.clone().unwrap_or_else(|| NONE.into()),
            machine.cores.map_or(NONE.into(), |cores| cores.to_string()),
        ]
    }));
    table
}
