//! Status of an episode: budget, phases, falls, result.

mod held;
mod next_phase;

use tandem_tools_spec::{
    Assistance, Briefing, Budget, EndReason, Operators, PhaseReached, PhaseTimes, ResultReply, RobotFallen,
    RobotInfo, StatusReply, Usage,
};

use super::Session;
use crate::commands::action_row;
use crate::convert::{rounded, wire_limits};
use crate::describe;
use crate::scoring::Phase;
use crate::spec::EpisodeSpec;

impl Session {
    /// Returns the world, for benches that control robots in ways that no command can.
    pub fn world_mut(&mut self) -> &mut tandem_sim::World {
        &mut self.world
    }

    pub(super) fn steps_left(&self) -> u32 {
        self.rules.episode_steps.saturating_sub(self.env_steps())
    }

    /// Returns the number of control steps executed, including the initial hold.
    pub fn env_steps(&self) -> u32 {
        self.present.control_step.saturating_sub(self.steps_before) as u32
    }

    pub(super) fn budget(&self) -> Budget {
        // The host keeps the operators' clocks, and reports the remaining time in their replies.
        let clock_left = match self.spec().operators {
            Operators::One => self.clock.left(),
            Operators::PerRobot => self.rules.thinking,
        };
        Budget {
            steps_left: self.steps_left(),
            wall_clock_left_s: clock_left.map(|left| rounded(left.as_secs_f64())),
            steps_per_command: self.rules.steps_per_command,
        }
    }

    pub(super) fn fallen(&self) -> Vec<RobotFallen> {
        let robots = self.motions.iter().zip(&self.present.robots);
        robots
            .map(|(motion, step)| RobotFallen { robot: motion.robot.name.clone(), fallen: step.truth.fallen })
            .collect()
    }

    /// Returns the fallen robots that are disclosed to the policy; none under the paper's assistance.
    pub(super) fn told_fallen(&self) -> Vec<RobotFallen> {
        match self.spec().assistance {
            Assistance::Paper => Vec::new(),
            Assistance::Full => self.fallen(),
        }
    }

    /// Returns true if success ends the episode now.
    pub(super) fn has_succeeded(&self) -> bool {
        self.spec().disclosure.ends_on_success() && self.scores.complete()
    }

    /// Returns the phases reached, if they are disclosed to the policy; none otherwise.
    pub(super) fn phases(&self) -> Vec<PhaseReached> {
        match self.spec().disclosure.tells(self.ended.is_some()) {
            true => self.reached(),
            false => Vec::new(),
        }
    }

    pub(super) fn reached(&self) -> Vec<PhaseReached> {
        let reached = self.scores.reached().enumerate();
        reached
            .map(|(index, (phase, time_s))| PhaseReached {
                id: phase.id.clone(),
                number: Phase::number(index),
                time_s,
            })
            .collect()
    }

    /// Returns the status of the episode, for viewers; this is no call.
    pub fn status(&self) -> StatusReply {
        let EpisodeSpec { assistance, disclosure, .. } = *self.spec();
        StatusReply {
            task: self.spec().task.id.clone(),
            seed: self.spec().told_seed(),
            protocol: self.spec().protocol,
            time_s: self.present.time_s,
            env_steps: self.env_steps(),
            ended: self.ended,
            fallen: self.told_fallen(),
            assistance,
            disclosure: Some(disclosure).filter(|told| *told != assistance.disclosure()),
            phases: self.phases(),
            next_phase: None,
            budget: self.budget(),
            state_hash: match assistance {
                Assistance::Paper => None,
                Assistance::Full => Some(self.state_hash()),
            },
        }
    }

    /// Returns the information needed to start.
    pub fn briefing(&self) -> Briefing {
        let task = &self.spec().task;
        let words = self.spec().task_words();
        // All robots of an episode have the same file.
        let kind = self.spec().robot.kind();
        let info = |name: &String| RobotInfo { robot: name.clone(), kind: kind.clone() };
        Briefing {
            instructions: describe::instructions(task, &words),
            shared_instruction: words.shared,
            instruction: words.joint,
            robots: self.motions.iter().map(|motion| info(&motion.robot.name)).collect(),
            kinds: vec![describe::robot_kind(kind.clone(), &self.motions[0].robot)],
            phases: match self.spec().assistance {
                Assistance::Paper => Vec::new(),
                Assistance::Full => describe::phases(task),
            },
            room: match self.spec().assistance {
                Assistance::Paper => Vec::new(),
                // An unreadable file would have prevented the world from being built.
                Assistance::Full => {
                    describe::room(task, self.spec().spread(), self.world.room()).unwrap_or_default()
                }
            },
            ending: describe::ending(self.spec().disclosure).into(),
            http: Vec::new(),
            brief: describe::brief(
                self.spec().wording(),
                &wire_limits(&self.motions[0].robot.base_limits),
                self.spec().camera,
                task.grips.as_deref(),
            ),
            action_row: action_row(&self.motions[0].robot.model),
            status: self.status(),
            recording_failed: self.recording_failed().map(str::to_owned),
        }
    }

    /// Returns the full result, including what the assistance hides from the policy. The result is final
    /// after the end.
    pub fn result(&self) -> ResultReply {
        match &self.result {
            Some(result) => result.clone(),
            None => self.result_so_far(),
        }
    }

    /// Returns the usage reported in notes and, at the end, the reason for the end.
    fn usage_so_far(&self) -> Usage {
        let usage = self.usage.clone();
        match self.ended {
            Some(reason) => usage.ended_by(reason),
            None => usage,
        }
    }

    /// Returns the seconds that the policy has thought, or all operators together.
    fn thinking_s(&self) -> f64 {
        match self.spec().operators {
            Operators::One => self.clock.spent().as_secs_f64(),
            Operators::PerRobot => self.operators.values().map(|used| used.thinking_s).sum(),
        }
    }

    fn result_so_far(&self) -> ResultReply {
        let mut times_s = self.scores.reached().map(|(_, time_s)| time_s);
        let phases = (0..self.spec().task.phases.len()).map(|index| (Phase::number(index), times_s.next()));
        let physics_s = self.physics.as_secs_f64();
        ResultReply {
            task: self.spec().task.id.clone(),
            seed: Some(self.spec().seed),
            protocol: self.spec().protocol,
            phases: PhaseTimes(phases.collect()),
            success: Some(self.scores.complete()),
            ended: self.ended.unwrap_or(EndReason::Finished),
            env_steps: self.env_steps(),
            tool_calls: self.tool_calls,
            requests: self.requests,
            thinking_s: rounded(self.thinking_s()),
            operators: self.operators.values().cloned().collect(),
            falls: self.fallen().iter().filter(|robot| robot.fallen).count() as u32,
            realtime_factor: if physics_s > 0.0 { self.present.time_s / physics_s } else { 0.0 },
            state_hash: Some(self.state_hash()),
            simulator_failure: self.simulator_failure.clone(),
            assistance: self.spec().assistance,
            extra_information: self.shown.names(),
            extra_information_replies: self.shown.replies(),
            joints_clamped_share: Some(rounded(self.joints_clamped_share())).filter(|share| *share > 0.0),
            departures: self.spec().departures().into_iter().chain(self.departures.iter().cloned()).collect(),
            recording_failed: self.recording_failed().map(str::to_owned),
            usage: (self.usage.notes > 0).then(|| self.usage_so_far()),
        }
    }
}
