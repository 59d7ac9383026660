//! Observation at one time, limited to the data that a policy may get.

use std::sync::Arc;

use tandem_episodes::{
    CONTROL_HZ, Picture,
    players::{LocalEpisode, PlayerError},
};
use tandem_tools_spec::{ExtraInformation, Observe, Tool as _};

use crate::columns::{EpisodeMoment, blank_state_values, held_row, state_values};

/// Observation of all robots at one time.
#[derive(Clone)]
pub struct PolicyObservation {
    /// One entry per robot, in the task's order.
    pub robots: Vec<RobotInputs>,
    /// Third-person image; `None` if the policy does not get it.
    pub third_person: Option<Arc<Picture>>,
}

/// Image and state of one robot.
#[derive(Clone)]
pub struct RobotInputs {
    pub picture: Arc<Picture>,
    /// State in the order of [`state_values`].
    pub state_values: Vec<f64>,
}

/// Returns the error for a reply that withholds the robot's own state, for which there is no substitute.
pub fn withheld(tool: &'static str) -> PlayerError {
    let reason = "the reply withholds gravity or odometry, which who asks a policy has to have".into();
    PlayerError::Call { tool, reason }
}

/// Size of blank images.
const WIDTH_PX: u32 = 320;
const HEIGHT_PX: u32 = 240;

impl PolicyObservation {
    /// Observes all robots. Also observes the third-person view if `shown` contains it.
    ///
    /// `shown` is the extra information for the policy, which the benchmark withholds from its own policies.
    pub fn take(
        episode: &mut dyn LocalEpisode,
        shown: &[ExtraInformation],
        moment: EpisodeMoment,
    ) -> Result<PolicyObservation, PlayerError> {
        let seen = episode.observe(&Observe::of_all(), shown)?;
        let moment = EpisodeMoment { done_steps: (seen.time_s * CONTROL_HZ).round(), ..moment };
        let third_person = shown.contains(&ExtraInformation::ThirdPerson);
        let inputs = seen.robots.iter().map(|robot| {
            let state_values = state_values(&robot.state, &moment).ok_or_else(|| withheld(Observe::NAME))?;
            Ok(RobotInputs { picture: robot.view.picture.clone(), state_values })
        });
        let third_person = third_person.then(|| episode.third_person()).transpose()?.map(Arc::new);
        let robots = inputs.collect::<Result<_, PlayerError>>()?;
        Ok(PolicyObservation { robots, third_person })
    }

    /// Returns, for each robot, the action row that holds its state.
    pub fn held_rows(&self) -> Vec<Vec<f64>> {
        self.robots.iter().map(|robot| held_row(&robot.state_values)).collect()
    }

    /// Returns black images and zeros of the right sizes, to probe a policy before an episode begins.
    pub fn blank(robots: usize) -> PolicyObservation {
        let black = vec![0; (3 * WIDTH_PX * HEIGHT_PX) as usize];
        let picture = Arc::new(Picture::new(WIDTH_PX, HEIGHT_PX, black));
        let inputs = || RobotInputs { picture: picture.clone(), state_values: blank_state_values() };
        PolicyObservation {
            robots: (0..robots).map(|_| inputs()).collect(),
            third_person: Some(picture.clone()),
        }
    }
}
