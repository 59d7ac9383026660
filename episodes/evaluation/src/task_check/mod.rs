//! Trial of a task before it is played. The task's world is built and simulated for two seconds without any
//! action. The check lists all objects that fall and all phases that are reached, and renders the first image
//! of each camera.

use std::path::{Path, PathBuf};

use tandem_episodes::{
    Built, Done, EpisodeError, EpisodeSpec, Facts, OutputError, Phase, build_world,
    replay::{EpisodeCamera, EpisodeRenderer},
    tasks::{Task, TaskDefinition, TaskWords},
    write_whole,
};
use tandem_sim::{CONTROL_HZ, RobotPress, Step};
use tandem_tools_spec::Protocol;

/// Length of the trial in control steps. It is longer than any fall from a table, and longer than the time
/// after which an object counts as released.
const TRIAL_STEPS: u32 = 100;
/// Distance within which an object counts as staying in place.
const STAYS_M: f32 = 0.03;
/// Height up to which contacts are those of feet on the floor.
const FEET_M: f32 = 0.08;
/// Angle within which an object counts as keeping its orientation.
const STAYS_RAD: f32 = 0.1;

/// Findings on a task in which no robot acts.
#[derive(Debug, Default)]
pub struct TaskCheck {
    /// Objects and robots that move from their places in the task, a line each, for the first seed that shows
    /// it.
    pub falls: Vec<String>,
    /// Observations that may be intended, a line each.
    pub notes: Vec<String>,
    /// Paths of the rendered images.
    pub pictures: Vec<PathBuf>,
}

#[derive(Debug, thiserror::Error)]
pub enum TaskCheckError {
    #[error("{task} cannot be played: {source}")]
    Episode { task: String, source: Box<EpisodeError> },
    #[error(
        "{task} goes wrong while nobody acts, with seed {seed}: {source}; look for shapes that begin within \
         each other"
    )]
    Diverged { task: String, seed: u32, source: tandem_sim::dynamics::Diverged },
    #[error(
        "{task}: phase {phase} is reached {time_s:.2} s after the start with seed {seed}, and nobody has \
         acted; ask for something that a robot has to do, as holds(...) or lift_m(...) >= 0.03"
    )]
    ReachedByNobody { task: String, phase: String, time_s: f64, seed: u32 },
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Checks a task with each of these seeds. Renders the start of the first seed into `folder`, if one is
/// given.
///
/// # Errors
///
/// If an episode cannot be started or fails.
pub fn check_task(task: &Task, seeds: &[u32], folder: Option<&Path>) -> Result<TaskCheck, TaskCheckError> {
    let mut check = TaskCheck::default();
    check.note_secrets(task);
    let mut falls = Falls::default();
    for (index, seed) in seeds.iter().enumerate() {
        let spec = EpisodeSpec::new(task, *seed, Protocol::Benchmark);
        check.stand_still(&spec, &mut falls)?;
        if index == 0
            && let Some(folder) = folder
        {
            check.draw(&spec, folder)?;
        }
    }
    check.falls = falls.told();
    Ok(check)
}

/// Objects and robots that do not stay in place. Each has a name, the description of the first case, and the
/// number of seeds.
#[derive(Default)]
struct Falls(Vec<(String, String, usize)>);

impl Falls {
    fn add(&mut self, what: &str, how: impl FnOnce() -> String) {
        match self.0.iter_mut().find(|(known, ..)| known == what) {
            Some((_, _, seeds)) => *seeds += 1,
            None => self.0.push((what.to_owned(), how(), 1)),
        }
    }

    fn told(self) -> Vec<String> {
        let line = |(_, how, seeds): (_, String, usize)| match seeds {
            1 => how,
            2 => how + " (so it is with another seed, too)",
            seeds => format!("{how} (so it is with {} other seeds, too)", seeds - 1),
        };
        self.0.into_iter().map(line).collect()
    }
    /// Finds all robots and objects that have moved from their places.
    fn find(
        &mut self,
        task: &Task,
        seed: u32,
        [start, end]: [&Step; 2],
        first_pressed: &[Option<RobotPress>],
    ) {
        let trial_s = f64::from(TRIAL_STEPS) / CONTROL_HZ;
        let robots = start.robots.iter().zip(&end.robots).zip(&task.robots).zip(first_pressed);
        for (((before, after), spot), pressed) in robots {
            let by_m =
                after.truth.world_from_pelvis().translation - before.truth.world_from_pelvis().translation;
            if after.truth.fallen || by_m.length() > STAYS_M {
                let how = if after.truth.fallen {
                    "falls".into()
                } else {
                    format!("moves by {:.2} m", by_m.length())
                };
                self.add(spot.name, || {
                    format!(
                        "seed {seed}: robot {} {how} within {trial_s:.0} s; it needs level floor at z = 0 and nothing in its way{}",
                        spot.name,
                        pressed.as_ref().map_or(String::new(), told_press)
                    )
                });
            }
        }
        for spot in &task.objects {
            let (Some(before), Some(after)) = (start.object(&spot.name), end.object(&spot.name)) else {
                continue;
            };
            let (before, after) = (before.world_from_object, after.world_from_object);
            let by_m = after.translation - before.translation;
            let turned_rad = before.rotation.angle_between(after.rotation);
            if by_m.length() > STAYS_M || turned_rad > STAYS_RAD {
                // Adding zero turns the negative zero of tiny negative values into a positive one.
                let round = |value: f32| (value * 100.0).round() / 100.0 + 0.0;
                let place = |place: [f32; 3]| {
                    let [x_m, y_m, z_m] = place.map(round);
                    format!("({x_m:.2}, {y_m:.2}, {z_m:.2})")
                };
                self.add(&spot.name, || {
                    format!(
                        "seed {seed}: {} does not stay at {}: within {trial_s:.0} s it comes to {} and turns by {:.0} degrees; put \
                         it where it touches what it stands on",
                        spot.name,
                        place(before.translation.to_array()),
                        place(after.translation.to_array()),
                        turned_rad.to_degrees()
                    )
                });
            }
        }
    }
}

/// Describes the first obstacle that a robot touches.
fn told_press(press: &RobotPress) -> String {
    let RobotPress { link, on, at_m } = press;
    let on = on.as_ref().map_or("the room".into(), |on| format!("{on:?}"));
    let [x_m, y_m, z_m] = at_m.to_array();
    format!(": first its {link} presses on {on}, at ({x_m:.2}, {y_m:.2}, {z_m:.2})")
}

impl TaskCheck {
    fn stand_still(&mut self, spec: &EpisodeSpec, falls: &mut Falls) -> Result<(), TaskCheckError> {
        let (task, seed) = (&spec.task, spec.seed);
        let failed =
            |source: EpisodeError| TaskCheckError::Episode { task: task.id.clone(), source: source.into() };
        let Built { mut world, motions, .. } = build_world(spec).map_err(failed)?;
        let start = world.present();
        let scores = task.scores(&motions[0].robot.model, &start);
        let mut scores = scores.map_err(|error| failed(error.into()))?;
        self.note_what_holds(task, &scores.facts(&start));
        let commands: Vec<_> = (0..world.robots().len()).map(|robot| world.rest_command(robot)).collect();
        let mut step = start.clone();
        let mut first_pressed = vec![None; commands.len()];
        for _ in 0..TRIAL_STEPS {
            let diverged = |source| TaskCheckError::Diverged { task: task.id.clone(), seed, source };
            step = world.control_step(&commands).map_err(diverged)?;
            scores.update(&step);
            for (robot, pressed) in first_pressed.iter_mut().enumerate() {
                let above_feet = |press: &RobotPress| press.at_m.z > FEET_M;
                *pressed = pressed.take().or_else(|| world.presses_of(robot).into_iter().find(above_feet));
            }
        }
        if let Some((phase, time_s)) = scores.reached().next() {
            let (task, phase) = (task.id.clone(), phase.id.clone());
            return Err(TaskCheckError::ReachedByNobody { task, phase, time_s, seed });
        }
        falls.find(task, seed, [&start, &step], &first_pressed);
        Ok(())
    }

    /// Notes texts that reveal the seed's choices to a robot's operator although that robot's instruction
    /// does not contain them.
    fn note_secrets(&mut self, task: &Task) {
        let ways = task.variants();
        let chosen =
            |text: &dyn Fn(&TaskDefinition) -> &str| ways.iter().any(|way| text(way) != text(&ways[0]));
        let (told, kept): (Vec<usize>, Vec<usize>) =
            (0..task.robots.len()).partition(|robot| chosen(&|way| &way.robots[*robot].instruction));
        if kept.is_empty() || told.is_empty() {
            return;
        }
        let names: Vec<&str> = kept.iter().map(|robot| task.robots[*robot].name).collect();
        let who = names.join(" and ");
        if chosen(&|way| way.shared_instruction.as_ref().unwrap_or(&way.instruction)) {
            self.notes.push(format!(
                "what the seed chooses is not in the own instruction of {who}, but an operator of that robot alone reads it in the \
                 joint one; give shared_instruction without it"
            ));
        }
        for (index, phase) in task.phases.iter().enumerate() {
            if chosen(&|way| &way.phases[index].description) {
                self.notes.push(format!(
                    "what the seed chooses is not in the own instruction of {who}, but the description of {} {} tells it to whoever is \
                     told phases; word it without",
                    Phase::number(index),
                    phase.id
                ));
            }
        }
        self.note_rewordings(ways, [&told, &kept]);
    }

    /// Notes rewordings that do not reveal the seed's choices to the same robots as the task's own wording.
    fn note_rewordings(&mut self, ways: &[TaskDefinition], [told, kept]: [&[usize]; 2]) {
        let levels = ways[0].rewordings.as_ref().map_or(0, |levels| levels.len());
        for level in 0..levels {
            let words: Vec<&TaskWords> =
                ways.iter().filter_map(|way| Some(&way.rewordings.as_ref()?[level])).collect();
            let chosen =
                |text: &dyn Fn(&TaskWords) -> &str| words.iter().any(|way| text(way) != text(words[0]));
            let tells = |robot: &usize| chosen(&|words| &words.robots[*robot]);
            let shared = chosen(&|words| words.shared.as_ref().unwrap_or(&words.joint));
            if shared || kept.iter().any(tells) || !told.iter().all(tells) {
                self.notes.push(format!(
                    "[[rewordings]] number {} do not tell the same robots what the seed chooses as the instructions do; {{...}} of a \
                     choice stands in the words of those that are told it, and in no others'",
                    level + 1
                ));
            }
        }
    }

    /// Notes conditions of later phases that hold before any action.
    fn note_what_holds(&mut self, task: &Task, facts: &Facts) {
        for (index, phase) in task.phases.iter().enumerate().skip(1) {
            let note = format!(
                "what {} {} asks for holds at the start already, so it is reached in the same step as the phase before it, unless \
                 that undoes it",
                Phase::number(index),
                phase.id
            );
            if holds(&phase.done, facts) && !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
    }

    fn draw(&mut self, spec: &EpisodeSpec, folder: &Path) -> Result<(), TaskCheckError> {
        let failed = |source: EpisodeError| TaskCheckError::Episode {
            task: spec.task.id.clone(),
            source: source.into(),
        };
        let start = build_world(spec).map_err(failed)?.world.present();
        let mut renderer = EpisodeRenderer::of(spec).map_err(failed)?;
        for view in EpisodeCamera::all(&spec.task) {
            let picture = renderer.colours(view, &start, None);
            let path = folder.join(format!("start_{}.png", view.name(&spec.task)));
            write_whole(&path, &picture.png().map_err(|error| failed(error.into()))?)?;
            self.pictures.push(path);
        }
        Ok(())
    }
}

/// Returns `true` if the phase would be reached immediately if it were the next one.
fn holds(done: &Done, facts: &Facts) -> bool {
    match done {
        Done::When(condition) => condition.holds(facts),
        Done::Sequence { first, then, .. } => first.holds(facts) && then.holds(facts),
        Done::Lasting { condition, at_end, .. } => {
            condition.holds(facts) && at_end.as_ref().is_none_or(|at_end| at_end.holds(facts))
        }
        Done::Milestones(milestones) => milestones.iter().all(|milestone| milestone.condition.holds(facts)),
        Done::Unless { spoiled, done } => !spoiled.holds(facts) && holds(done, facts),
    }
}

#[cfg(test)]
mod tests;
