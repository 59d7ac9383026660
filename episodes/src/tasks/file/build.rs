//! Construction of a [`Task`] from its TOML table: resolves every name and collects all mistakes, not
//! only the first.

use std::ops::RangeInclusive;

use toml::Spanned;

use super::choices::{Choice, ways, with_options};
use super::error::{Mistakes, TaskFileError};
use super::phases;
use super::reading::Reading;
use super::rewordings::in_words;
use super::table::{Extent, OffsetTable, RobotTable, TaskTable};
use crate::conditions::Names;
use crate::scoring::{Phase, ROBOT_NAMES};
use crate::tasks::embedded::origin_of;
use crate::tasks::task::TaskFile;
use crate::tasks::{ChosenOption, ObjectSpot, Offset, RobotSpot, TaskDefinition, TaskOrigin, TaskSource};

const MAX_PHASES: usize = 12;
/// Minimum distance between the robots' start positions: robots that start closer touch each other.
const ROBOT_NAMES_APART_M: f64 = 0.35;
/// Maximum absolute value of a coordinate.
pub(super) const FARTHEST_M: f64 = 100.0;
const DEFAULT_BENCHMARK_STEPS: u32 = 1000;
/// The benchmark's budget under the agentic protocol.
const DEFAULT_AGENTIC_STEPS: u32 = 6000;
const DEFAULT_THINKING_S: u32 = 1800;
/// The minimum leaves room for the 300 steps for which robots stand still before a policy's first call.
const AGENTIC_STEPS_ALLOWED: RangeInclusive<u32> = 400..=200_000;
const BENCHMARK_STEPS_ALLOWED: RangeInclusive<u32> = 50..=200_000;
const THINKING_S_ALLOWED: RangeInclusive<u32> = 1..=1_000_000;

/// Returns the names of the MJCF files that a task file refers to.
pub(super) fn files_beside(source: &TaskSource) -> Result<Vec<String>, TaskFileError> {
    let table = parse(source)?;
    let named = table.scene.into_iter().chain(table.objects.into_iter().filter_map(|object| object.file));
    Ok(named.map(Spanned::into_inner).filter(|name| is_file(name)).collect())
}

fn parse(source: &TaskSource) -> Result<TaskTable, TaskFileError> {
    toml::from_str(&source.text).map_err(|error| {
        let at = error.span().unwrap_or(0..0);
        let mistakes = vec![(at, error.message().to_owned())];
        TaskFileError::Mistakes(Mistakes::new(&source.name, &source.text, mistakes))
    })
}

pub(super) fn is_file(name: &str) -> bool {
    name.ends_with(".xml")
}

/// Returns the definitions of the task that a source describes.
pub(super) fn file(source: &TaskSource, xxh3: &str) -> Result<TaskFile, TaskFileError> {
    let table = parse(source)?;
    let mut reading = Reading::new(source, &[]);
    let choices = reading.choices(&table.choices);
    reading.checked()?;
    let definitions = ways(&choices).into_iter().map(|way| one_way(source, xxh3, way));
    let mut definitions: Vec<TaskDefinition> = definitions.collect::<Result<_, _>>()?;
    Ok(match choices.is_empty() {
        true => TaskFile { undecided: definitions.swap_remove(0), variants: Vec::new() },
        false => TaskFile { undecided: undecided(&definitions[0], &table, &choices), variants: definitions },
    })
}

/// Returns the definition whose texts name all options, made from the definition of any variant.
fn undecided(variant: &TaskDefinition, table: &TaskTable, choices: &[Choice]) -> TaskDefinition {
    let with_all = |text: &Spanned<String>| with_options(text.as_ref(), choices);
    let robots = variant.robots.iter().zip(table.robots.as_ref());
    let phases = variant.phases.iter().zip(table.phases.as_ref());
    let rewordings = table.rewordings.as_ref();
    TaskDefinition {
        instruction: with_all(&table.instruction),
        shared_instruction: table.shared_instruction.as_ref().map(with_all),
        rewordings: rewordings.and_then(|rewordings| in_words(rewordings.as_ref(), with_all)),
        robots: robots
            .map(|(spot, table)| RobotSpot { instruction: with_all(&table.instruction), ..spot.clone() })
            .collect(),
        phases: phases
            .map(|(phase, table)| Phase { description: with_all(&table.description), ..phase.clone() })
            .collect(),
        chosen: Vec::new(),
        ..variant.clone()
    }
}

/// Returns the definition for one combination of options.
fn one_way(
    source: &TaskSource,
    xxh3: &str,
    chosen: Vec<ChosenOption>,
) -> Result<TaskDefinition, TaskFileError> {
    let mut reading = Reading::new(source, &chosen);
    let table = parse(&reading.source)?;
    let read = reading.definition(table);
    reading.checked()?;
    let Some(definition) = read else { return Err(reading.mistakes()) };
    let source = source.clone();
    Ok(TaskDefinition { origin: origin_of(&source), source, xxh3: xxh3.into(), chosen, ..definition })
}

impl Reading<'_> {
    /// Returns the definition without its source; `None` if it cannot be built.
    fn definition(&mut self, table: TaskTable) -> Option<TaskDefinition> {
        self.id(&table.id, "the task");
        self.words(&table.instruction);
        table.shared_instruction.iter().for_each(|text| self.words(text));
        let benchmark_steps =
            self.within(&table.budget.benchmark_steps, &BENCHMARK_STEPS_ALLOWED, DEFAULT_BENCHMARK_STEPS);
        let agentic_steps =
            self.within(&table.budget.agentic_steps, &AGENTIC_STEPS_ALLOWED, DEFAULT_AGENTIC_STEPS);
        let thinking_s = self.within(&table.budget.thinking_s, &THINKING_S_ALLOWED, DEFAULT_THINKING_S);
        let scene = self.scene(&table);
        let robots = self.robots(&table.robots);
        let mut names =
            Names { robots: robots.iter().map(|robot| robot.name.to_owned()).collect(), ..Names::default() };
        let objects = self.objects(&table.objects, scene.as_ref(), &mut names);
        let randomize = self.offsets(&table.randomize, &objects, &names);
        if table.phases.as_ref().is_empty() || table.phases.as_ref().len() > MAX_PHASES {
            self.wrong(table.phases.span(), format!("a task has 1 to {MAX_PHASES} [[phases]]"));
        }
        let phases = phases::phases(self, table.terms, table.phases.into_inner(), &mut names);
        let rewordings = self.rewordings(&table.rewordings, &table.shared_instruction, &robots);
        let (phases, conditions): (Vec<_>, Vec<_>) = phases.into_iter().unzip();
        let (scene, scene_document) = scene?;
        Some(TaskDefinition {
            id: table.id.into_inner(),
            scene,
            scene_document,
            robots,
            objects,
            randomize,
            instruction: table.instruction.into_inner(),
            shared_instruction: table.shared_instruction.map(Spanned::into_inner),
            rewordings,
            benchmark_steps,
            agentic_steps,
            thinking_s,
            phases: phases.into(),
            conditions,
            says_needs_fingers: table.needs_fingers,
            grips: table.grips,
            origin: TaskOrigin::File,
            source: TaskSource::default(),
            xxh3: String::new(),
            chosen: Vec::new(),
        })
    }

    fn within(&mut self, given: &Option<Spanned<u32>>, range: &RangeInclusive<u32>, default: u32) -> u32 {
        let Some(given) = given else { return default };
        if !range.contains(given.as_ref()) {
            let what = format!("this may be {} to {}, for example {default}", range.start(), range.end());
            self.wrong(given.span(), what);
        }
        *given.as_ref()
    }

    /// Checks that coordinates or angles are finite and within `most_value` of zero.
    pub(super) fn finite<T>(&mut self, given: &Spanned<T>, values: &[f64], most_value: f64) {
        if values.iter().any(|value| !value.is_finite() || value.abs() > most_value) {
            self.wrong(given.span(), format!("a number here is at most {most_value} either way"));
        }
    }

    fn robots(&mut self, tables: &Spanned<Vec<RobotTable>>) -> Vec<RobotSpot> {
        let (span, tables) = (tables.span(), tables.as_ref());
        let names: Vec<&str> = tables.iter().map(|robot| robot.name.as_ref().as_str()).collect();
        if tables.is_empty() || tables.len() > ROBOT_NAMES.len() || names != ROBOT_NAMES[..tables.len()] {
            let other = tables.iter().zip(ROBOT_NAMES).find(|(robot, name)| robot.name.as_ref() != name);
            let other = other.map(|(robot, _)| robot).or(tables.get(ROBOT_NAMES.len()));
            let at = other.map_or(span, |robot| robot.name.span());
            let what = format!(
                "there are 1 to 3 [[robots]], called \"A\", \"B\" and \"C\" in this order; here: {names:?}"
            );
            self.wrong(at, what);
        }
        for (index, robot) in tables.iter().enumerate() {
            self.words(&robot.instruction);
            let [x_m, y_m] = *robot.position_m.as_ref();
            self.finite(&robot.position_m, &[x_m, y_m], FARTHEST_M);
            for other in &tables[..index] {
                let [other_x_m, other_y_m] = *other.position_m.as_ref();
                if f64::hypot(x_m - other_x_m, y_m - other_y_m) < ROBOT_NAMES_APART_M {
                    let what = format!(
                        "robots stand at least {ROBOT_NAMES_APART_M} m apart; {} is here, too",
                        other.name.as_ref()
                    );
                    self.wrong(robot.position_m.span(), what);
                }
            }
        }
        // Later checks refer to robots by their expected names.
        let spot = |(robot, name): (&RobotTable, &'static str)| RobotSpot {
            name,
            position_m: robot.position_m.as_ref().map(|value| value as f32),
            yaw_rad: angle_rad(robot.yaw_deg.as_ref()),
            instruction: robot.instruction.as_ref().clone(),
        };
        tables.iter().zip(ROBOT_NAMES).map(spot).collect()
    }

    fn offsets(&mut self, tables: &[OffsetTable], objects: &[ObjectSpot], names: &Names) -> Vec<Offset> {
        tables.iter().map(|table| self.offset(table, objects, names)).collect()
    }

    fn offset(&mut self, table: &OffsetTable, objects: &[ObjectSpot], names: &Names) -> Offset {
        let mut moved: Vec<String> = Vec::new();
        for name in table.objects.as_ref() {
            match objects.iter().find(|spot| spot.name == *name.as_ref()) {
                Some(spot) => {
                    self.can_be_moved(spot, name);
                    moved.push(spot.name.clone());
                }
                None if names.mistaken_objects.contains(name.as_ref()) => {}
                None => {
                    let have: Vec<&str> = objects.iter().map(|spot| spot.name.as_str()).collect();
                    let what = format!("no object {:?} to move; have: {}", name.as_ref(), have.join(", "));
                    self.wrong(name.span(), what);
                }
            }
        }
        if table.objects.as_ref().is_empty() {
            self.wrong(table.objects.span(), "this moves nothing; name objects, for example [\"bottle\"]");
        }
        let mut range = |given: &Option<Spanned<Extent>>, most_value: f64| {
            let Some(given) = given else { return 0.0..=0.0 };
            let [from, to] = match *given.as_ref() {
                Extent::EitherWay(value) => [-value, value],
                Extent::FromTo(values) => values,
            };
            self.finite(given, &[from, to], most_value);
            if from > to {
                let what = format!(
                    "this ends before it begins; give [{to}, {from}], or one number for so much either way"
                );
                self.wrong(given.span(), what);
            }
            from..=to
        };
        let metres = |range: RangeInclusive<f64>| *range.start() as f32..=*range.end() as f32;
        let [x_m, y_m, z_m] =
            [&table.x_m, &table.y_m, &table.z_m].map(|given| metres(range(given, FARTHEST_M)));
        let yaw_deg = range(&table.yaw_deg, 360.0);
        let wider_deg = table.wider_yaw_deg.as_ref();
        if let Some(given) = wider_deg {
            self.finite(given, &[*given.as_ref()], 360.0);
        }
        Offset {
            objects: moved,
            x_m,
            y_m,
            z_m,
            yaw_rad: rad(*yaw_deg.start())..=rad(*yaw_deg.end()),
            wider_yaw_rad: angle_rad(wider_deg),
            on_wall: table.on_wall,
        }
    }
}

pub(super) fn angle_rad(given: Option<&Spanned<f64>>) -> f32 {
    given.map_or(0.0, |given| rad(*given.as_ref()))
}

/// Converts degrees, as the file gives them, to radians.
fn rad(angle_deg: f64) -> f32 {
    angle_deg.to_radians() as f32
}
