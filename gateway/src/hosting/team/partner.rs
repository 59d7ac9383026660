//! Partners of this process that drive one robot beside people or programs: the task's expert, or a
//! learned policy.
//!
//! The expert plays its script for all robots, and its own robot does its part. If a step of the script
//! does not succeed in time, the script gives up and begins again from the current state.

use std::{fmt, sync::Arc, thread};

use tandem_episodes::{
    EpisodeSpec,
    players::{Episode, LocalEpisode, PlayerError, PrivilegedPlayer, experts::Expert},
};
use tandem_evaluation::policies::PlayError;
use tandem_tools_spec::{Finish, Note, Wait};
use tokio::{runtime::Handle, sync::oneshot};

use super::{Team, one_robot::OneRobot, round::PartnerKind};
use crate::hosting::{EpisodeThread, HostingError};

/// Control steps for which the robot stands before the expert's script begins again.
const PAUSE_STEPS: u32 = 25;

/// A remote policy that can drive one robot of an episode. It plays all robots, and its own does its
/// part.
pub trait PartnerPolicy: fmt::Debug + Send + Sync {
    /// Returns the name by which people choose it and recordings name it.
    fn name(&self) -> String;

    /// Connects for an episode of `spec`, calls `connected` when that is done, and plays.
    ///
    /// # Errors
    ///
    /// Returns a [`PlayError`] if it cannot connect. The inner [`PlayerError`] says why the play ended.
    fn play(
        &self,
        spec: &EpisodeSpec,
        episode: &mut dyn LocalEpisode,
        connected: &mut dyn FnMut(),
    ) -> Result<Result<(), PlayerError>, PlayError>;
}

impl Team {
    /// Lets the expert of the task drive `robot` until the episode ends or everybody else has finished.
    ///
    /// The expert uses privileged information; that is recorded, and results name it. Repeated requests
    /// change nothing.
    pub async fn take_expert(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        robot: &str,
    ) -> Result<(), HostingError> {
        let seat = self.seat(robot)?;
        let spec = episode.spec().clone();
        Expert::for_episode(&spec).map_err(HostingError::NoExpert)?;
        if self.wheels().partners[seat].replace(PartnerKind::Expert).is_some() {
            return Ok(());
        }
        drop(episode.watch_driving(robot).await?);
        let text = format!("The task's expert drives robot {robot}.");
        episode.note(Some(robot), Note { text, ..Note::default() }, None).await?;
        let own = self.one_robot(episode, seat, robot);
        let thread = thread::Builder::new().name(format!("expert of {robot}"));
        thread.spawn(move || play_expert(own, &spec)).map_err(HostingError::Thread)?;
        Ok(())
    }

    /// Lets `policy` drive `robot` until the episode ends or everybody else has finished. Returns when it
    /// is connected.
    ///
    /// The policy receives the inputs that its map names for all robots. Repeated requests change nothing
    /// while it drives; a lost one is connected again.
    pub async fn take_policy(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        robot: &str,
        policy: Arc<dyn PartnerPolicy>,
    ) -> Result<(), HostingError> {
        let seat = self.seat(robot)?;
        self.round().check_plays(seat)?;
        if self.wheels().partners[seat].replace(PartnerKind::Policy).is_some() {
            return Ok(());
        }
        let text = format!("The policy {} drives robot {robot}.", policy.name());
        let own = self.one_robot(episode, seat, robot);
        let (connected, connection) = oneshot::channel();
        let thread = thread::Builder::new().name(format!("policy of {robot}"));
        thread.spawn(move || play_policy(own, &*policy, connected)).map_err(HostingError::Thread)?;
        match connection.await.map_err(|_| HostingError::EpisodeStopped)? {
            Ok(()) => episode.note(Some(robot), Note { text, ..Note::default() }, None).await,
            Err(error) => {
                self.wheels().partners[seat] = None;
                Err(HostingError::NoPolicy { reason: error.to_string() })
            }
        }
    }

    /// Lets the partners drive again that drove when the previous server ended; `policy` is the one that
    /// may drive here.
    pub async fn seat_again(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        policy: Result<Arc<dyn PartnerPolicy>, HostingError>,
    ) {
        let policy = policy.map_err(Arc::new);
        let left = self.wheels().left.clone();
        for (seat, kind) in left.into_iter().enumerate() {
            let robot = &self.seats[seat].robot;
            let seated = match kind {
                None => continue,
                Some(PartnerKind::Expert) => self.take_expert(episode, robot).await,
                Some(PartnerKind::Policy) => match policy.clone() {
                    Ok(policy) => self.take_policy(episode, robot, policy).await,
                    Err(none) => Err(HostingError::Shared(none)),
                },
            };
            self.wheels().left[seat] = None;
            if let Err(error) = seated {
                tracing::warn!(%error, robot, "nobody drives a robot again that was driven from here");
                self.lose_partner(episode, seat);
            }
        }
    }

    /// Returns true while a partner still has to be brought back.
    pub fn misses_partners(&self) -> bool {
        self.wheels().left.iter().any(Option::is_some)
    }

    /// Stops waiting for the robot on `seat`, whose partner is lost, until it is driven again.
    fn lose_partner(self: &Arc<Self>, episode: &Arc<EpisodeThread>, seat: usize) {
        self.round().fall_silent(seat);
        self.wheels().partners[seat] = None;
        self.go_on(episode);
    }

    fn one_robot(self: &Arc<Self>, episode: &Arc<EpisodeThread>, seat: usize, robot: &str) -> OneRobot {
        let (team, episode, runtime) = (self.clone(), episode.clone(), Handle::current());
        OneRobot { team, episode, seat, robot: robot.into(), runtime }
    }
}

/// Plays until nobody else does.
fn play_expert(mut own: OneRobot, spec: &EpisodeSpec) {
    while own.has_company() {
        let played = Expert::for_episode(spec).and_then(|mut expert| expert.play(&mut own));
        let paused = match played {
            Ok(()) | Err(PlayerError::GaveUp(_)) => own.call(Wait { steps: PAUSE_STEPS }.into()).map(drop),
            Err(error) => Err(error),
        };
        match paused {
            Ok(()) => {}
            Err(PlayerError::EpisodeOver) => break,
            Err(error) => {
                tracing::warn!(%error, robot = own.robot, "the expert of a robot has stopped");
                break;
            }
        }
    }
    // The others stop waiting for it. An ended episode cannot be notified.
    let _ = own.ask(Finish {}.into());
}

/// Plays until the episode is over or the policy is lost. A loss is noted in the recording, and the
/// policy may be requested again.
fn play_policy(
    mut own: OneRobot,
    policy: &dyn PartnerPolicy,
    connected: oneshot::Sender<Result<(), PlayError>>,
) {
    let mut connected = Some(connected);
    let mut answer = |came_of_it| {
        if let Some(connected) = connected.take() {
            // The caller may have gone.
            let _ = connected.send(came_of_it);
        }
    };
    let spec = own.episode.spec().clone();
    let (team, seat) = (own.team.clone(), own.seat);
    let mut connected = || {
        // The policy's first look shows all that has happened until now.
        team.round().has_looked(seat);
        answer(Ok(()));
    };
    let failed = match policy.play(&spec, &mut own, &mut connected) {
        Err(error) => return answer(Err(error)),
        Ok(Ok(()) | Err(PlayerError::EpisodeOver)) => None,
        Ok(Err(error)) => Some(error),
    };
    if let Some(error) = failed {
        tracing::warn!(%error, robot = own.robot, "the policy of a robot has stopped");
        let text = format!("The policy of robot {} has stopped: {error}", own.robot);
        let note = own.episode.note(Some(&own.robot), Note { text, ..Note::default() }, None);
        // An ended episode takes no notes.
        let _ = own.runtime.block_on(note);
        let _runtime = own.runtime.enter();
        return own.team.lose_partner(&own.episode, own.seat);
    }
    let _ = own.ask(Finish {}.into());
}
