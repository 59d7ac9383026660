//! Falls: physics of robots that stagger, are dropped or are struck. Unlike an episode, the bench places
//! robots in the air and pushes doors.

mod cases;
mod commands;
mod floor;
mod in_tasks;

use std::fmt;

use serde::Serialize;
use tandem_sim::dynamics::Diverged;
use tandem_sim::world::{Extremes, Watch};
use tandem_sim::{RobotCommand, World};

use cases::{FALL_CASES, FallCase, FallPlace};
pub use floor::FloorEpisode;
pub use in_tasks::falls;

/// Result of one trial.
#[derive(Clone, Debug, Serialize)]
pub struct FallTrial {
    /// The played case, for example a task and its seed.
    pub played: String,
    pub control_steps: u32,
    /// Number of fallen robots at the end.
    pub fallen: usize,
    /// Place where physics computed a number that is not finite; `None` if there was none.
    pub diverged: Option<String>,
    pub extremes: Extremes,
    /// Commands of a single robot on a floor.
    #[serde(skip)]
    pub floor: Option<FloorEpisode>,
}

/// One case over its episodes.
#[derive(Clone, Debug, Serialize)]
pub struct FallsCase {
    pub case: String,
    pub episodes: usize,
    /// Number of fallen robots at the end of their episodes.
    pub fallen: usize,
    pub diverged: usize,
    /// Places of the divergence, episode by episode.
    pub diverged_at: Vec<String>,
    /// Number of episodes that broke each limit.
    pub broken: Broken,
    pub greatest: Extremes,
}

/// Number of episodes that exceeded each limit; see [`tandem_sim::world::Extremes`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Broken {
    pub speed: usize,
    pub energy: usize,
    pub depth: usize,
    pub range: usize,
}

/// Results of all cases.
#[derive(Clone, Debug, Serialize)]
pub struct FallsReport {
    pub cases: Vec<FallsCase>,
    /// Trials of single robots on a floor, with their commands.
    #[serde(skip)]
    pub floor: Vec<(FallTrial, FloorEpisode)>,
}

/// Plays `steps` control steps. `next` returns the robots' commands for each step, and may disturb the world.
fn play(
    world: &mut World,
    steps: u32,
    mut next: impl FnMut(&mut World, u32) -> Vec<RobotCommand>,
) -> FallTrial {
    let mut watch = Watch::default();
    let mut diverged: Option<Diverged> = None;
    let mut control_steps = 0;
    let mut fallen = 0;
    while control_steps < steps && diverged.is_none() {
        let commands = next(world, control_steps);
        match world.watched_step(&commands, &mut watch) {
            Ok(step) => fallen = step.robots.iter().filter(|robot| robot.truth.fallen).count(),
            Err(error) => diverged = Some(error),
        }
        control_steps += 1;
    }
    let diverged = diverged.map(|error| format!("step {control_steps}: {error}"));
    FallTrial {
        played: String::new(),
        control_steps,
        fallen,
        diverged,
        extremes: watch.extremes,
        floor: None,
    }
}

impl FallsCase {
    /// Summarises the trials of one case.
    pub fn of(case: &str, trials: &[FallTrial]) -> FallsCase {
        let mut greatest = Extremes::default();
        let mut broken = Broken::default();
        for trial in trials {
            greatest.join(&trial.extremes, |at| format!("{}: {at}", trial.played));
            let [speed, energy, depth, range] = trial.extremes.broken().map(usize::from);
            broken.speed += speed;
            broken.energy += energy;
            broken.depth += depth;
            broken.range += range;
        }
        let at = |trial: &FallTrial| Some(format!("{}, {}", trial.played, trial.diverged.as_ref()?));
        let diverged_at: Vec<String> = trials.iter().filter_map(at).collect();
        FallsCase {
            case: case.into(),
            episodes: trials.len(),
            fallen: trials.iter().map(|trial| trial.fallen).sum(),
            diverged: diverged_at.len(),
            diverged_at,
            broken,
            greatest,
        }
    }

    /// Header of the table of cases: greatest values, with the number of episodes beyond the limit in
    /// brackets.
    pub const HEAD: &str = "case                  episodes fallen diverged  fastest link    energy made        deeper than 2 cm      beyond range  fastest joint";
}

impl fmt::Display for FallsCase {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Extremes { speed_m_s, made_j, made_share, depth_m, deep_s, beyond_rad, joint_speed_share } =
            &self.greatest;
        write!(
            f,
            "{:22}{:>8}{:>7}{:>9}  {:>6.1} m/s ({})  {:>6.1} J, {:>3.0} % ({})  {:>3.0} mm, {:.2} s ({})  {:.2} rad ({})  {:>3.0} % of its motor",
            self.case,
            self.episodes,
            self.fallen,
            self.diverged,
            speed_m_s.value,
            self.broken.speed,
            made_j.value,
            made_share.value * 100.0,
            self.broken.energy,
            depth_m.value * 1e3,
            deep_s.value,
            self.broken.depth,
            beyond_rad.value,
            self.broken.range,
            joint_speed_share.value * 100.0,
        )
    }
}
