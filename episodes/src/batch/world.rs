//! One world of a batch: episode after episode.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use tandem_tools_spec::ToolCall;

use super::{Autoreset, BatchError, BatchSpec, STATE_COLUMNS};
use crate::Session;
use crate::commands::base_row;
use crate::spec::EpisodeSpec;

/// Where a world begins that nobody gave a seed: with the first of those that are neither reported nor held out.
const FIRST_SEED: u32 = 2000;

/// What a step is rewarded with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RewardKind {
    /// 1 for each phase that it reaches.
    Sparse,
    /// What it adds to the task's progress: phases reached, and how near the next one is, from 0 to 1.
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

/// What a step came to in one world, or the beginning of an episode there.
#[derive(Clone, Debug, Default)]
pub struct WorldStep {
    pub reward: f64,
    /// Whether the last phase has been reached, or a robot has fallen.
    pub terminated: bool,
    /// Whether the budget has run out, or the simulator has failed.
    pub truncated: bool,
    /// How many phases have been reached.
    pub phases: usize,
    pub fallen: Vec<bool>,
    /// Control steps of the episode.
    pub env_steps: u32,
    /// The episode's seed.
    pub seed: u32,
    /// The seed of the episode that has begun behind it, in the same step.
    pub next_seed: Option<u32>,
    /// How the simulator failed, if it did.
    pub failure: Option<String>,
    /// Share of the episode's joint targets that lay beyond the joints' limits.
    pub joints_clamped_share: f64,
}

/// What is seen of a world; nothing of one that has panicked.
#[derive(Default)]
pub struct SeenWorld {
    /// [`STATE_COLUMNS`] a robot.
    pub state_rows: Vec<f32>,
    /// One a robot, where they have been drawn.
    pub pictures: Vec<Vec<u8>>,
}

/// What a step came to, and what is seen then.
pub struct SeenStep {
    pub outcome: WorldStep,
    pub seen: SeenWorld,
    /// The last of the episode, where the next one has begun in the same step.
    pub last: Option<SeenWorld>,
    /// Whether pictures are still to be drawn, with those of other worlds.
    pub undrawn: bool,
}

/// Episode after episode.
pub struct BatchWorld {
    index: usize,
    /// By so much the seeds of a world's episodes lie apart: as many as there are worlds.
    stride: u32,
    /// The seed that this round began with; `None` before the first.
    round_seed: Option<u32>,
    /// Episodes of this round that have begun.
    episodes: u32,
    /// `None` before the first, and after a panic.
    pub session: Option<Session>,
    /// Whether the episode is over.
    pub over: bool,
    progress: f64,
}

impl BatchWorld {
    pub fn new(index: usize, worlds: usize) -> BatchWorld {
        let stride = u32::try_from(worlds).unwrap_or(u32::MAX);
        BatchWorld { index, stride, round_seed: None, episodes: 0, session: None, over: false, progress: 0.0 }
    }

    /// Whether a step is in order, where worlds are reset like this.
    pub fn takes(&self, autoreset: Autoreset) -> bool {
        if self.over { autoreset != Autoreset::Disabled } else { self.session.is_some() }
    }

    /// Begins a round: with this seed, or with the one after that of the last round.
    pub fn reset(&mut self, spec: &BatchSpec, seed: Option<u32>) -> Result<SeenStep, BatchError> {
        let next = match self.round_seed {
            Some(last) => last.wrapping_add(self.stride),
            None => FIRST_SEED.wrapping_add(self.index as u32),
        };
        self.round_seed = Some(seed.unwrap_or(next));
        self.episodes = 0;
        self.begin(spec)
    }

    /// Begins the next episode of the round. Its seed is the index's: no episode begins elsewhere because another one ended sooner.
    fn begin(&mut self, spec: &BatchSpec) -> Result<SeenStep, BatchError> {
        let round_seed = self.round_seed.unwrap_or(FIRST_SEED);
        let seed = round_seed.wrapping_add(self.stride.wrapping_mul(self.episodes));
        self.close();
        let episode = spec.episode.seeded(seed);
        let folder = spec.record.as_ref().map(|record| self.folder(record, &episode));
        let session = Session::start(&episode, folder.as_deref())?;
        if let Some(reason) = session.recording_failed() {
            // Whoever wants a recording has no use for the episode.
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

    /// One control step, or the beginning of the next episode.
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
            // An episode's last pictures cannot wait: its world goes.
            if let Some(session) = self.session.as_mut().filter(|_| step.undrawn) {
                step.seen.pictures = draw(spec, session);
            }
            let next = self.begin(spec)?;
            step.outcome.next_seed = Some(next.outcome.seed);
            (step.last, step.seen, step.undrawn) = (Some(step.seen), next.seen, next.undrawn);
        }
        Ok(step)
    }

    /// One control step, and what it came to. What goes wrong in a world is told of this world alone.
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

    /// A folder that no other episode has.
    fn folder(&self, record: &Path, episode: &EpisodeSpec) -> PathBuf {
        let name = format!("{}-world{}-seed{}", episode.task.id, self.index, episode.seed);
        let again = (2..).map(|time| record.join(format!("{name}-{time}")));
        let free = std::iter::once(record.join(&name)).chain(again).find(|folder| !folder.exists());
        free.unwrap_or_else(|| record.join(&name))
    }

    /// Ends the episode, if one is under way, and closes its recording, which has the result.
    pub fn close(&mut self) {
        if let Some(session) = self.session.take() {
            session.close();
        }
    }
}

/// What is seen of a world after a step; pictures only where they are to be drawn, and not yet if they are better drawn together with those
/// of other worlds.
fn look(spec: &BatchSpec, session: &mut Session, outcome: WorldStep, draws: bool) -> SeenStep {
    let mut state_rows = Vec::with_capacity(session.present().robots.len() * STATE_COLUMNS);
    for robot in &session.present().robots {
        state_rows.extend(robot.sensed.joints.q_rad);
        state_rows.extend(base_row(&robot.command.base));
    }
    let draws = draws && spec.pictures_px.is_some();
    let undrawn = draws && session.draws_together();
    let pictures = if draws && !undrawn { draw(spec, session) } else { Vec::new() };
    SeenStep { outcome, seen: SeenWorld { state_rows, pictures }, last: None, undrawn }
}

/// Draws what the robots of a world see.
fn draw(spec: &BatchSpec, session: &mut Session) -> Vec<Vec<u8>> {
    let Some(size_px) = spec.pictures_px else { return Vec::new() };
    (0..session.present().robots.len()).map(|robot| session.eye(robot, size_px)).collect()
}
