//! Partners of this process that drive one robot beside people or programs: the task's expert, or a
//! learned policy.
//!
//! The expert runs its script for all robots, but only the commands of its own robot are executed. If a step
//! of the script does not succeed in time, the script is aborted and starts again from the current state.

use std::{sync::Arc, thread};

use tandem_episodes::{
    EpisodeSpec,
    players::{Episode, PlayerError, PrivilegedPlayer, experts::Expert},
};
use tandem_evaluation::policies::{PartnerPolicy, PlayError};
use tandem_tools_spec::{Finish, Note, Wait};
use tokio::{runtime::Handle, sync::oneshot};

use super::{
    Team,
    handle::OperatorHandle,
    one_robot::OneRobot,
    round::{Operator, PartnerKind},
};
use crate::hosting::{EpisodeThread, HostingError};

/// Control steps for which the robot holds still before the expert's script starts again.
const PAUSE_STEPS: u32 = 25;

impl OperatorHandle {
    /// Starts the expert of the task, which drives the robot until the episode ends or all other operators
    /// have finished.
    ///
    /// The expert uses privileged information. The recording and the results state this. Repeated requests
    /// have no effect.
    pub async fn take_expert(&self) -> Result<(), HostingError> {
        let (robot, spec) = (self.robot(), self.episode.spec().clone());
        Expert::for_episode(&spec).map_err(HostingError::NoExpert)?;
        if self.own(|own| own.partner.replace(PartnerKind::Expert)).is_some() {
            return Ok(());
        }
        drop(self.episode.watch_driving(robot).await?);
        let text = format!("The task's expert drives robot {robot}.");
        self.episode.note(Some(robot), Note { text, ..Note::default() }, None).await?;
        let player = OneRobot { operator: self.clone(), runtime: Handle::current() };
        let thread = thread::Builder::new().name(format!("expert of {robot}"));
        thread.spawn(move || play_expert(player, &spec)).map_err(HostingError::Thread)?;
        Ok(())
    }

    /// Starts `policy`, which drives the robot until the episode ends or all other operators have finished.
    /// Returns when the policy is connected.
    ///
    /// The policy receives the inputs that its map names for all robots. Repeated requests have no effect
    /// while it drives. After a lost connection, a new request connects it again.
    pub async fn take_policy(&self, policy: Arc<dyn PartnerPolicy>) -> Result<(), HostingError> {
        self.own(|own| own.check_plays())?;
        if self.own(|own| own.partner.replace(PartnerKind::Policy)).is_some() {
            return Ok(());
        }
        let robot = self.robot();
        let text = format!("The policy {} drives robot {robot}.", policy.name());
        let player = OneRobot { operator: self.clone(), runtime: Handle::current() };
        let (connected, connection) = oneshot::channel();
        let thread = thread::Builder::new().name(format!("policy of {robot}"));
        thread.spawn(move || play_policy(player, &*policy, connected)).map_err(HostingError::Thread)?;
        match connection.await.map_err(|_| HostingError::EpisodeStopped)? {
            Ok(()) => self.episode.note(Some(robot), Note { text, ..Note::default() }, None).await,
            Err(error) => {
                self.own(|own| own.partner = None);
                Err(HostingError::NoPolicy { reason: error.to_string() })
            }
        }
    }

    /// Removes the lost partner of the robot. The others do not wait for the robot until it is driven again.
    fn lose_partner(&self) {
        self.own(|own| {
            own.fall_silent();
            own.partner = None;
        });
        self.go_on();
    }
}

/// Restores the partners of `team` that drove when the previous server ended. `policy` is the policy that may
/// drive on this server.
pub async fn seat_again(
    team: &Arc<Team>,
    episode: &Arc<EpisodeThread>,
    policy: Result<Arc<dyn PartnerPolicy>, HostingError>,
) {
    let policy = policy.map_err(Arc::new);
    let left: Vec<Option<PartnerKind>> = team.round().operators.iter().map(|own| own.left).collect();
    for (seat, kind) in left.into_iter().enumerate() {
        let operator = OperatorHandle { team: team.clone(), episode: episode.clone(), seat };
        let seated = match kind {
            None => continue,
            Some(PartnerKind::Expert) => operator.take_expert().await,
            Some(PartnerKind::Policy) => match policy.clone() {
                Ok(policy) => operator.take_policy(policy).await,
                Err(none) => Err(HostingError::Shared(none)),
            },
        };
        operator.own(|own| own.left = None);
        if let Err(error) = seated {
            let robot = operator.robot();
            tracing::warn!(%error, robot, "nobody drives a robot again that was driven from here");
            operator.lose_partner();
        }
    }
}

/// Plays the expert until no other operator plays.
fn play_expert(mut own: OneRobot, spec: &EpisodeSpec) {
    while own.wait_for_others() {
        let played = Expert::for_episode(spec).and_then(|mut expert| expert.play(&mut own));
        let paused = match played {
            Ok(()) | Err(PlayerError::GaveUp(_)) => own.call(Wait { steps: PAUSE_STEPS }.into()).map(drop),
            Err(error) => Err(error),
        };
        match paused {
            Ok(()) => {}
            Err(PlayerError::EpisodeOver) => break,
            Err(error) => {
                tracing::warn!(%error, robot = own.operator.robot(), "the expert of a robot has stopped");
                break;
            }
        }
    }
    // Finishing releases the others from waiting for this operator. The error of an ended episode is ignored.
    let _ = own.ask(Finish {}.into());
}

/// Plays the policy until the episode is over or the connection to the policy is lost. The loss is noted in
/// the recording, and the policy may be requested again.
fn play_policy(
    mut own: OneRobot,
    policy: &dyn PartnerPolicy,
    connected: oneshot::Sender<Result<(), PlayError>>,
) {
    let mut connected = Some(connected);
    let mut answer = |came_of_it| {
        if let Some(connected) = connected.take() {
            // The caller may have stopped waiting.
            let _ = connected.send(came_of_it);
        }
    };
    let operator = own.operator.clone();
    let mut connected = || {
        // The policy's first observation includes everything that has happened until now.
        operator.own(Operator::has_looked);
        answer(Ok(()));
    };
    let failed = match policy.play(operator.episode.spec(), &mut own, &mut connected) {
        Err(error) => return answer(Err(error)),
        Ok(Ok(()) | Err(PlayerError::EpisodeOver)) => None,
        Ok(Err(error)) => Some(error),
    };
    if let Some(error) = failed {
        let robot = operator.robot();
        tracing::warn!(%error, robot, "the policy of a robot has stopped");
        let text = format!("The policy of robot {robot} has stopped: {error}");
        let note = operator.episode.note(Some(robot), Note { text, ..Note::default() }, None);
        // An ended episode takes no notes.
        let _ = own.runtime.block_on(note);
        let _runtime = own.runtime.enter();
        return operator.lose_partner();
    }
    let _ = own.ask(Finish {}.into());
}
