//! One world of a batch, which plays one episode after another.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use tandem_episodes::{
    EpisodeSpec, Session,
    rows::{joint_row, state_row},
};
use tandem_tools_spec::{ACTION_ROW_LEN, ToolCall};

use super::{Autoreset, BatchError, BatchSpec, STATE_COLUMNS};

/// Default seed of the first world: the first seed that is neither reported nor held out.
const FIRST_SEED: u32 = 2000;

/// Reward of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RewardKind {
    /// 1 for each phase that the step reaches.
    Sparse,
    /// The step's increase of the task's progress: number of phases reached, plus the nearness of the next
    /// one, from 0 to 1.
    Dense,
}

impl RewardKind {
    pub const ALL: [RewardKind; 2] = [RewardKind::Sparse, RewardKind::Dense];

    pub fn name(self) -> &'static str {
        match self {
            RewardKind::Sparse => "sparse",
            RewardKind::Dense => "dense",
        }
    }
}

/// Outcome of a step in one world, or of the start of an episode there.
#[derive(Clone, Debug, Default)]
pub struct WorldStep {
    pub reward: f64,
    /// True if the last phase has been reached, or a robot has fallen.
    pub terminated: bool,
    /// True if the budget has run out, or the simulator has failed.
    pub truncated: bool,
    /// Number of phases that have been reached.
    pub phases: usize,
    pub fallen: Vec<bool>,
    /// Control steps of the episode.
    pub env_steps: u32,
    /// The episode's seed.
    pub seed: u32,
    /// Seed of the next episode, if it has begun in the same step.
    pub next_seed: Option<u32>,
    /// Text of the simulator's failure; `None` without one.
    pub failure: Option<String>,
    /// Share of the episode's joint targets beyond the joints' limits.
    pub joints_clamped_share: f64,
}

/// Observation of a world; empty for a world that has panicked.
#[derive(Default)]
pub struct SeenWorld {
    /// [`STATE_COLUMNS`] numbers for each robot.
    pub state_rows: Vec<f32>,
    /// One image for each robot, if they have been rendered.
    pub pictures: Vec<Vec<u8>>,
}

/// Outcome of a step, and the observation after it.
pub struct SeenStep {
    pub outcome: WorldStep,
    pub seen: SeenWorld,
    /// Final observation of the episode, if the next one has begun in the same step.
    pub last: Option<SeenWorld>,
    /// True if images have been deferred, to be rendered together with images of other worlds.
    pub undrawn: bool,
}

/// A world of a batch, which plays one episode after another.
pub struct BatchWorld {
    index: usize,
    /// Difference between the seeds of a world's successive episodes, which is the number of worlds.
    stride: u32,
    /// Seed with which this round began; `None` before the first.
    round_seed: Option<u32>,
    /// Number of episodes that have begun in this round.
    episodes: u32,
    /// `None` before the first episode, and after a panic.
    pub session: Option<Session>,
    /// True once the episode is over.
    pub over: bool,
    progress: f64,
}

impl BatchWorld {
    pub fn new(index: usize, worlds: usize) -> BatchWorld {
        let stride = u32::try_from(worlds).unwrap_or(u32::MAX);
        BatchWorld { index, stride, round_seed: None, episodes: 0, session: None, over: false, progress: 0.0 }
    }

    /// Returns `true` if the world can take a step under this kind of reset.
    pub fn takes(&self, autoreset: Autoreset) -> bool {
        if self.over { autoreset != Autoreset::Disabled } else { self.session.is_some() }
    }

    /// Begins a round with this seed, or else with the last round's seed plus the stride.
    pub fn reset(&mut self, spec: &BatchSpec, seed: Option<u32>) -> Result<SeenStep, BatchError> {
        let next = match self.round_seed {
            Some(last) => last.wrapping_add(self.stride),
            None => FIRST_SEED.wrapping_add(self.index as u32),
        };
        self.round_seed = Some(seed.unwrap_or(next));
        self.episodes = 0;
        self.begin(spec)
    }

    /// Begins the next episode of the round. Its seed depends only on its index in the round: an early end of
    /// another episode does not change it.
    fn begin(&mut self, spec: &BatchSpec) -> Result<SeenStep, BatchError> {
        let round_seed = self.round_seed.unwrap_or(FIRST_SEED);
        let seed = round_seed.wrapping_add(self.stride.wrapping_mul(self.episodes));
        self.close();
        let episode = spec.episode.seeded(seed);
        let folder = spec.record.as_ref().map(|record| self.folder(record, &episode));
        let session = Session::start(&episode, folder.as_deref())?;
        if let Some(reason) = session.recording_failed() {
            // A caller that requests a recording has no use for an unrecorded episode.
            return Err(BatchError::NotRecorded { seed, reason: reason.into() });
        }
        let session = self.session.insert(session);
        self.episodes += 1;
        self.over = false;
        self.progress = match spec.reward {
            RewardKind::Sparse => 0.0,
            RewardKind::Dense => session.progress(),
        };
        let fallen = vec![false; episode.task.robots.len()];
        let outcome = WorldStep { seed, fallen, ..WorldStep::default() };
        Ok(look(spec, session, outcome, true))
    }

    /// Returns the joint rows of the present commands; zeros without an episode.
    pub fn joint_rows(&self, robots: usize) -> Vec<Vec<f64>> {
        match &self.session {
            Some(session) => session.present().robots.iter().map(|robot| joint_row(&robot.command)).collect(),
            None => vec![vec![0.0; ACTION_ROW_LEN]; robots],
        }
    }

    /// Executes one row for each robot, or begins the next episode.
    pub fn step(
        &mut self,
        spec: &BatchSpec,
        call: &ToolCall,
        autoreset: Autoreset,
        looks: bool,
    ) -> Result<SeenStep, BatchError> {
        if self.over {
            return self.begin(spec);
        }
        let outcome = self.advance(spec, call);
        self.over = outcome.terminated || outcome.truncated;
        let mut step = match &mut self.session {
            Some(session) => look(spec, session, outcome, looks || self.over),
            None => SeenStep { outcome, seen: SeenWorld::default(), last: None, undrawn: false },
        };
        if self.over && autoreset == Autoreset::SameStep {
            // An episode's last images cannot be deferred, because its world is about to be replaced.
            if let Some(session) = self.session.as_mut().filter(|_| step.undrawn) {
                step.seen.pictures = draw(spec, session);
            }
            let next = self.begin(spec)?;
            step.outcome.next_seed = Some(next.outcome.seed);
            (step.last, step.seen, step.undrawn) = (Some(step.seen), next.seen, next.undrawn);
        }
        Ok(step)
    }

    /// Makes the call of a step and returns its outcome. An error affects only this world.
    fn advance(&mut self, spec: &BatchSpec, call: &ToolCall) -> WorldStep {
        let Some(session) = &mut self.session else { return WorldStep::default() };
        let (seed, before) = (session.spec().seed, session.reached_phases());
        let failure = match catch_unwind(AssertUnwindSafe(|| session.act_unreported(call))) {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some(error.to_string()),
            Err(_) => {
                self.session = None;
                let failure = Some("the simulator panicked".into());
                return WorldStep { seed, truncated: true, failure, ..WorldStep::default() };
            }
        };
        let reached = session.reached_phases();
        let reward = match spec.reward {
            RewardKind::Sparse => (reached - before) as f64,
            RewardKind::Dense => {
                let progress = session.progress();
                progress - std::mem::replace(&mut self.progress, progress)
            }
        };
        let fallen: Vec<bool> = session.present().robots.iter().map(|robot| robot.truth.fallen).collect();
        let terminated = reached == session.spec().task.phases.len() || fallen.contains(&true);
        let truncated = !terminated && (failure.is_some() || session.ended().is_some());
        let env_steps = session.env_steps();
        let joints_clamped_share = session.joints_clamped_share();
        let next_seed = None;
        WorldStep {
            reward,
            terminated,
            truncated,
            phases: reached,
            fallen,
            env_steps,
            seed,
            next_seed,
            failure,
            joints_clamped_share,
        }
    }

    /// Returns a folder that no other episode uses.
    fn folder(&self, record: &Path, episode: &EpisodeSpec) -> PathBuf {
        let name = format!("{}-world{}-seed{}", episode.task.id, self.index, episode.seed);
        let again = (2..).map(|time| record.join(format!("{name}-{time}")));
        let free = std::iter::once(record.join(&name)).chain(again).find(|folder| !folder.exists());
        free.unwrap_or_else(|| record.join(&name))
    }

    /// Ends the episode, if one is in progress, and closes its recording, which contains the result.
    pub fn close(&mut self) {
        if let Some(session) = self.session.take() {
            session.close();
        }
    }
}

/// Returns the observation of a world after a step. Images are rendered only if `draws` is true. They are
/// deferred if it is faster to render them together with those of other worlds.
fn look(spec: &BatchSpec, session: &mut Session, outcome: WorldStep, draws: bool) -> SeenStep {
    let mut state_rows = Vec::with_capacity(session.present().robots.len() * STATE_COLUMNS);
    for robot in &session.present().robots {
        state_rows.extend(state_row(robot));
    }
    let draws = draws && spec.pictures_px.is_some();
    let undrawn = draws && session.draws_together();
    let pictures = if draws && !undrawn { draw(spec, session) } else { Vec::new() };
    SeenStep { outcome, seen: SeenWorld { state_rows, pictures }, last: None, undrawn }
}

/// Renders the images of a world's robots.
fn draw(spec: &BatchSpec, session: &mut Session) -> Vec<Vec<u8>> {
    let Some(size_px) = spec.pictures_px else { return Vec::new() };
    (0..session.present().robots.len()).map(|robot| session.eye(robot, size_px)).collect()
}
