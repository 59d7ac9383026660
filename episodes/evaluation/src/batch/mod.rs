//! Batches for learners: worlds of one task that step together in one call, with numeric arrays as inputs and
//! outputs.

mod parallel;
mod world;

pub use world::{RewardKind, WorldStep};

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tandem_episodes::{
    EpisodeError, EpisodeSpec, Session,
    rows::{ActionKind, STATE_COLUMNS},
    scaled_colours,
};
use tandem_sim::render::render_colours_together;
use tandem_tools_spec::ToolCall;

use parallel::Threads;
use world::{BatchWorld, SeenStep, SeenWorld};

/// Default size of an image from a robot's own camera.
pub const PICTURE_PX: [u32; 2] = [320, 240];

/// Reason why a batch cannot reset or step.
#[derive(Debug, thiserror::Error)]
pub enum BatchError {
    #[error("world {world} has no episode under way; reset it first")]
    NotBegun { world: usize },
    #[error("the batch has {have} worlds, 0 to {}; there is no world {world}", have - 1)]
    NoWorld { world: usize, have: usize },
    #[error("the episode of seed {seed} cannot be recorded: {reason}")]
    NotRecorded { seed: u32, reason: String },
    #[error(transparent)]
    Episode(#[from] EpisodeError),
}

/// Specification of a batch.
#[derive(Clone, Debug)]
pub struct BatchSpec {
    /// Spec of every episode, except for its seed.
    pub episode: EpisodeSpec,
    pub worlds: usize,
    /// Number of threads that step the worlds.
    pub threads: usize,
    pub actions: ActionKind,
    /// Number of control steps in which robots carry out one row.
    pub steps_per_row: u32,
    pub reward: RewardKind,
    /// Width and height of each robot's camera image; `None` for no images.
    pub pictures_px: Option<[u32; 2]>,
    /// Folder with a folder for every recorded episode; `None` if they are not recorded.
    pub record: Option<PathBuf>,
}

/// Time at which a world whose episode is over begins its next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Autoreset {
    /// The next episode begins in place of the step that follows the final one.
    NextStep,
    /// The next episode begins in the same step in which the last one ends.
    SameStep,
    /// An episode begins only when the world is reset.
    Disabled,
}

impl Autoreset {
    pub const ALL: [Autoreset; 3] = [Autoreset::NextStep, Autoreset::SameStep, Autoreset::Disabled];

    pub fn name(self) -> &'static str {
        match self {
            Autoreset::NextStep => "next_step",
            Autoreset::SameStep => "same_step",
            Autoreset::Disabled => "disabled",
        }
    }
}

/// Arrays for the observations: world after world, and robot after robot in each.
#[derive(Default)]
pub struct SeenArrays<'a> {
    /// [`STATE_COLUMNS`] numbers for each robot.
    pub state_rows: &'a mut [f32],
    /// RGB images (height, width, channel), one for each robot; empty for no images.
    pub pictures: &'a mut [u8],
}

/// A step of a batch: one row for each robot.
#[derive(Clone, Copy, Debug)]
pub struct BatchStep<'a> {
    /// Action columns, by robot within each world.
    pub action_rows: &'a [f32],
    pub autoreset: Autoreset,
    /// True if the policy observes this step. Images of other steps are rendered only where an episode
    /// begins or is over.
    pub looks: bool,
}

/// Worlds that step together.
pub struct Batch {
    spec: Arc<BatchSpec>,
    worlds: Arc<[Mutex<BatchWorld>]>,
    threads: Threads,
}

/// Outcome of a step in each world that took one.
type Steps = Vec<Option<Result<SeenStep, BatchError>>>;

impl Batch {
    /// Creates worlds without episodes.
    pub fn new(spec: BatchSpec) -> Batch {
        let worlds = (0..spec.worlds).map(|index| Mutex::new(BatchWorld::new(index, spec.worlds))).collect();
        let threads = Threads::start(spec.threads.min(spec.worlds));
        Batch { spec: Arc::new(spec), worlds, threads }
    }

    pub fn spec(&self) -> &BatchSpec {
        &self.spec
    }

    /// Begins an episode in each world that has an entry. It has the given seed, or else the seed of the
    /// world's next round. The episodes of a round do not depend on how many began automatically in the last
    /// one.
    ///
    /// # Errors
    ///
    /// If an episode cannot be started or recorded.
    pub fn reset(
        &mut self,
        seeds: &[Option<Option<u32>>],
        seen: SeenArrays,
    ) -> Result<Vec<Option<WorldStep>>, BatchError> {
        let seeds = seeds.to_vec();
        let steps = self.each(move |index, world, spec| Some(world.reset(spec, (*seeds.get(index)?)?)));
        let outcomes = self.write(steps, seen, SeenArrays::default());
        outcomes.into_iter().map(Option::transpose).collect()
    }

    /// Executes one row for each robot in each world, or begins the world's next episode. `last` receives the
    /// final observation of an episode if the next one begins in the same step. If any action is invalid, no
    /// world steps.
    ///
    /// # Errors
    ///
    /// If an action is invalid, or a world has no episode in progress.
    pub fn step(
        &mut self,
        step: BatchStep,
        seen: SeenArrays,
        last: SeenArrays,
    ) -> Result<Vec<WorldStep>, BatchError> {
        let calls = self.calls(&step)?;
        let BatchStep { autoreset, looks, .. } = step;
        let steps =
            self.each(move |index, world, spec| Some(world.step(spec, calls.get(index)?, autoreset, looks)));
        self.write(steps, seen, last).into_iter().flatten().collect()
    }

    /// Runs `work` on every world.
    fn each(
        &self,
        work: impl Fn(usize, &mut BatchWorld, &BatchSpec) -> Option<Result<SeenStep, BatchError>>
        + Send
        + Sync
        + 'static,
    ) -> Steps {
        let (spec, worlds) = (self.spec.clone(), self.worlds.clone());
        self.threads.map(worlds.len(), move |index| work(index, &mut held(&worlds[index]), &spec))
    }

    /// Writes the observations, and returns the outcomes of the steps.
    fn write(
        &self,
        mut steps: Steps,
        seen: SeenArrays,
        last: SeenArrays,
    ) -> Vec<Option<Result<WorldStep, BatchError>>> {
        self.draw_undrawn(&mut steps);
        let places = seen.split(self.spec.worlds).zip(last.split(self.spec.worlds));
        let write =
            |(step, (seen, last)): (Option<Result<SeenStep, BatchError>>, (SeenArrays, SeenArrays))| {
                Some(step?.map(|step| {
                    seen.write(&step.seen);
                    if let Some(of_last) = &step.last {
                        last.write(of_last);
                    }
                    step.outcome
                }))
            };
        steps.into_iter().zip(places).map(write).collect()
    }

    /// Renders all images that worlds have deferred, together.
    fn draw_undrawn(&self, steps: &mut Steps) {
        let Some(size_px) = self.spec.pictures_px else { return };
        let mut worlds: Vec<_> = self.worlds.iter().map(held).collect();
        let (mut requests, mut places) = (Vec::new(), Vec::new());
        for (world, step) in worlds.iter_mut().zip(steps) {
            if let (Some(session), Some(Ok(step))) = (&mut world.session, step)
                && step.undrawn
            {
                let request = session.eyes(size_px);
                let drawn_px: Vec<_> =
                    request.cameras.iter().map(|camera| [camera.width, camera.height]).collect();
                requests.push(request);
                places.push((&mut step.seen.pictures, drawn_px));
            }
        }
        for ((place, drawn_px), pictures) in places.into_iter().zip(render_colours_together(requests)) {
            let scaled = |(rgb, drawn_px)| scaled_colours(rgb, drawn_px, size_px);
            *place = pictures.into_iter().zip(drawn_px).map(scaled).collect();
        }
    }

    /// Checks the step and returns the call for each world.
    fn calls(&self, step: &BatchStep) -> Result<Vec<ToolCall>, BatchError> {
        if let Some(world) = self.worlds.iter().position(|world| !held(world).takes(step.autoreset)) {
            return Err(BatchError::NotBegun { world });
        }
        let BatchSpec { actions, steps_per_row, ref episode, .. } = *self.spec;
        let rows = step.action_rows.chunks_exact(actions.row_len() * episode.task.robots.len());
        let asked = self.worlds.iter().zip(rows).map(|(world, row)| {
            let before_rows = held(world).joint_rows(episode.task.robots.len());
            let act = actions.call(episode.task.robot_names(), row, &before_rows, steps_per_row);
            let call = ToolCall::Act(act);
            call.validate().map_err(EpisodeError::from)?;
            Ok(call)
        });
        asked.collect()
    }

    /// Renders the camera images of a world's robots in this size.
    ///
    /// # Errors
    ///
    /// If there is no such world, or it has no episode in progress.
    pub fn draw(&mut self, world: usize, size_px: [u32; 2]) -> Result<Vec<u8>, BatchError> {
        self.ask(world, |session| {
            let robots = session.spec().task.robots.len();
            (0..robots).flat_map(|robot| session.eye(robot, size_px)).collect()
        })
    }

    /// Returns the hash of a world's state; see [`Session::state_hash`].
    ///
    /// # Errors
    ///
    /// If there is no such world, or it has no episode in progress.
    pub fn state_hash(&mut self, world: usize) -> Result<String, BatchError> {
        self.ask(world, |session| session.state_hash())
    }

    fn ask<T>(&self, world: usize, asked: impl FnOnce(&mut Session) -> T) -> Result<T, BatchError> {
        let have = self.worlds.len();
        let found = self.worlds.get(world).ok_or(BatchError::NoWorld { world, have })?;
        held(found).session.as_mut().map(asked).ok_or(BatchError::NotBegun { world })
    }
}

/// Closes all recordings, so that they are complete even if their episodes were not played to the end.
impl Drop for Batch {
    fn drop(&mut self) {
        self.worlds.iter().for_each(|world| held(world).close());
    }
}

/// Locks a world. A world that has panicked has no session; see [`BatchWorld::session`].
fn held(world: &Mutex<BatchWorld>) -> MutexGuard<'_, BatchWorld> {
    world.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<'a> SeenArrays<'a> {
    /// Returns arrays without images.
    pub fn of_states(state_rows: &'a mut [f32]) -> SeenArrays<'a> {
        SeenArrays { state_rows, pictures: &mut [] }
    }

    /// Splits the arrays into one part for each world; the parts of an empty array are empty.
    fn split(self, worlds: usize) -> impl Iterator<Item = SeenArrays<'a>> {
        let state_rows = parts(self.state_rows, worlds);
        let pictures = parts(self.pictures, worlds);
        state_rows.zip(pictures).map(|(state_rows, pictures)| SeenArrays { state_rows, pictures })
    }

    /// Writes the observation of a world to its part.
    fn write(self, seen: &SeenWorld) {
        self.state_rows.iter_mut().zip(&seen.state_rows).for_each(|(place, number)| *place = *number);
        let each = seen.pictures.first().map_or(1, Vec::len);
        for (place, picture) in self.pictures.chunks_exact_mut(each).zip(&seen.pictures) {
            place.copy_from_slice(picture);
        }
    }
}

fn parts<T>(whole: &mut [T], parts: usize) -> impl Iterator<Item = &mut [T]> {
    let each = whole.len() / parts.max(1);
    let mut rest = whole;
    (0..parts).map(move |_| {
        let (part, others) = std::mem::take(&mut rest).split_at_mut(each);
        rest = others;
        part
    })
}

#[cfg(test)]
mod tests;
