//! Information for a policy. Information that its assistance withholds is removed from every reply here and
//! nowhere else. Information that the benchmark withholds from its policies is counted by kind and by robot.

mod short;

pub use short::{shorten, shorten_plan};

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use tandem_tools_spec::{
    ActCall, Assistance, CommandReply, ExtraInformation, FingerReport, Formats, HandReport, JoinedBy,
    LookCall, LookReply, ManageCall, ManageReply, PoseFrame, Protocol, RobotReport, RobotState, SpecError,
    ToolCall, ToolReply,
};

use super::Session;
use super::answer::Answer;
use crate::EpisodeError;
use crate::commands::{Allowed, Called};
use crate::observation::TeamObservation;

/// Number of replies with information that the benchmark withholds from its policies.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ShownInformation(BTreeMap<ExtraInformation, BTreeMap<String, u32>>);

impl ShownInformation {
    /// Returns the names of the information shown.
    pub fn names(&self) -> Vec<String> {
        self.0.keys().map(|what| what.name().into()).collect()
    }

    /// Returns the number of replies with each kind of information, by name and robot.
    pub fn replies(&self) -> BTreeMap<String, BTreeMap<String, u32>> {
        self.0.iter().map(|(what, robots)| (what.name().into(), robots.clone())).collect()
    }

    /// Counts an observation that has shown everything in `shown` for each of its robots.
    pub fn count_each(&mut self, shown: &[ExtraInformation], seen: &TeamObservation) {
        for robot in &seen.robots {
            shown.iter().for_each(|what| self.count(*what, &robot.state.robot));
        }
    }

    /// Counts a reply that has shown the information `what` about `robot`.
    fn count(&mut self, what: ExtraInformation, robot: &str) {
        *self.0.entry(what).or_default().entry(robot.into()).or_default() += 1;
    }

    /// Counts the information in an answer from which withheld data have been removed. An observation is in
    /// the formats of its call.
    pub fn count_answer(&mut self, answer: &Answer, formats: &Formats, protocol: Protocol) {
        match answer {
            Answer::Observation(seen) => self.count_seen(seen, formats),
            Answer::Reply(reply) => match &**reply {
                ToolReply::Act(reply) => reply.robots.iter().for_each(|report| self.count_report(report)),
                // The commands have been counted one by one.
                ToolReply::Plan(plan) => {
                    let holders: BTreeSet<&str> = plan.held.iter().map(|held| held.robot.as_str()).collect();
                    holders
                        .into_iter()
                        .for_each(|robot| self.count(ExtraInformation::PhaseConditions, robot));
                }
                ToolReply::Look(LookReply::GetRobotState(state)) => self.count_state(state),
                ToolReply::Look(LookReply::QueryDepth(depth)) => {
                    let by_name = depth.surfaces.iter().any(|found| found.joined_by == JoinedBy::Object);
                    let shown = [
                        // Agents of the benchmark have this information; its learned policies do not.
                        (ExtraInformation::PixelDepth, protocol == Protocol::Benchmark),
                        (ExtraInformation::ObjectPixels, by_name),
                    ];
                    self.count_those(&shown, &depth.robot);
                }
                // The information belongs to no single robot.
                ToolReply::Manage(ManageReply::GetStatus(status)) if status.next_phase.is_some() => {
                    status
                        .fallen
                        .iter()
                        .for_each(|of| self.count(ExtraInformation::PhaseConditions, &of.robot));
                }
                ToolReply::Look(LookReply::CheckReach(_) | LookReply::Observe(_))
                | ToolReply::Manage(_)
                | ToolReply::Talk(_) => {}
            },
        }
    }

    /// Counts the information in a refusal: that a robot does not see an object.
    pub fn count_refusal(&mut self, refusal: &EpisodeError, called: &Called) {
        if let EpisodeError::NoSurface { query, .. } = refusal
            && query.object.is_some()
        {
            let robots = called.calls().into_iter().flat_map(|call| call.robots());
            robots.for_each(|robot| self.count(ExtraInformation::ObjectPixels, robot));
        }
    }

    /// Counts the information in an observation.
    fn count_seen(&mut self, seen: &TeamObservation, formats: &Formats) {
        for robot in &seen.robots {
            self.count_state(&robot.state);
            if formats.depth.is_some() || seen.shows_depth {
                self.count(ExtraInformation::DepthImages, &robot.state.robot);
            }
        }
    }

    fn count_state(&mut self, state: &RobotState) {
        let shown = [
            (ExtraInformation::JointVelocities, state.joint_velocities_rad_s.is_some()),
            (ExtraInformation::JointTorques, state.joint_torques_n_m.is_some()),
            (ExtraInformation::Gravity, state.gravity_in_pelvis.is_some()),
            (ExtraInformation::Odometry, state.pelvis_in_start.is_some()),
            (ExtraInformation::InertialReadings, state.samples.is_some()),
        ];
        self.count_those(&shown, &state.robot);
    }

    /// Counts the information in an answer that shows all of a robot's state.
    pub fn count_whole_state(&mut self, robot: &str) {
        let shown = [
            ExtraInformation::JointVelocities,
            ExtraInformation::JointTorques,
            ExtraInformation::Gravity,
            ExtraInformation::Odometry,
        ];
        shown.into_iter().for_each(|what| self.count(what, robot));
    }

    fn count_report(&mut self, report: &RobotReport) {
        let hands = [&report.left, &report.right];
        let shown = [
            (ExtraInformation::JointTorques, hands.iter().any(|hand| hand.largest_effort.is_some())),
            (ExtraInformation::HandForces, hands.iter().any(|hand| hand.force_n.is_some())),
            (ExtraInformation::Odometry, report.pelvis_in_start.is_some() || report.base_motion.is_some()),
        ];
        self.count_those(&shown, &report.robot);
    }

    fn count_those(&mut self, shown: &[(ExtraInformation, bool)], robot: &str) {
        for (what, _) in shown.iter().filter(|(_, is_shown)| *is_shown) {
            self.count(*what, robot);
        }
    }
}

impl Answer {
    /// Returns the answer as a policy with this assistance receives it.
    pub fn told(&self, assistance: Assistance) -> Answer {
        let mut told = self.clone();
        told.withhold(assistance);
        told
    }

    /// Removes the information withheld from a policy with this assistance.
    fn withhold(&mut self, assistance: Assistance) {
        match (assistance, self) {
            (Assistance::Full, _) => {}
            (Assistance::Paper, Answer::Observation(seen)) => withhold_seen(seen),
            (Assistance::Paper, Answer::Reply(reply)) => match &mut **reply {
                ToolReply::Act(reply) => withhold_report(reply),
                ToolReply::Plan(reply) => withhold_report(&mut reply.last),
                ToolReply::Look(LookReply::GetRobotState(state)) => withhold_state(state),
                ToolReply::Look(LookReply::Observe(seen)) => seen.states.iter_mut().for_each(withhold_state),
                ToolReply::Look(LookReply::CheckReach(reach)) => reach.needs_a_step = false,
                // The reply to a query of pixels, and the status, which is already in the policy's form.
                ToolReply::Look(LookReply::QueryDepth(_)) | ToolReply::Manage(_) | ToolReply::Talk(_) => {}
            },
        }
    }
}

fn withhold_seen(seen: &mut TeamObservation) {
    seen.robots.iter_mut().for_each(|robot| withhold_state(&mut robot.state));
}

// The patterns have no `..`, so the compiler reports every new field.

fn withhold_state(state: &mut RobotState) {
    let RobotState {
        robot: _,
        time_s: _,
        // Other frames are refused.
        frame: _,
        joint_positions_rad: _,
        joint_velocities_rad_s,
        joint_torques_n_m,
        left_wrist: _,
        right_wrist: _,
        left_wrist_target,
        right_wrist_target,
        gravity_in_pelvis,
        pelvis_in_start,
        pelvis_in_room,
        base_command: _,
        fallen,
        samples,
    } = state;
    (*joint_velocities_rad_s, *joint_torques_n_m) = (None, None);
    (*left_wrist_target, *right_wrist_target) = (None, None);
    (*gravity_in_pelvis, *pelvis_in_start, *pelvis_in_room, *fallen) = (None, None, None, None);
    *samples = None;
}

fn withhold_report(reply: &mut CommandReply) {
    let CommandReply {
        executed_steps: _,
        stop_reason: _,
        time_s: _,
        robots,
        fallen,
        // Already in the form of the disclosure.
        phases: _,
        budget: _,
    } = reply;
    fallen.clear();
    for report in robots {
        let RobotReport {
            robot: _,
            // Other frames are refused.
            frame: _,
            left,
            right,
            base,
            pelvis_in_start,
            pelvis_in_room,
            base_motion,
            waist_joints_clamped: _,
            waist_joints_at_limit: _,
            base_command_clamped: _,
        } = report;
        (*base, *pelvis_in_start, *pelvis_in_room, *base_motion) = (None, None, None, None);
        withhold_hand(left);
        withhold_hand(right);
    }
}

fn withhold_hand(hand: &mut HandReport) {
    let HandReport {
        state,
        grip,
        presses,
        touches,
        target: _,
        measured: _,
        position_error_m: _,
        orientation_error_rad: _,
        given_way_m,
        fingers,
        largest_effort,
        force_n,
        joints_clamped: _,
        joints_at_limit: _,
    } = hand;
    (*state, *grip, *touches, *given_way_m) = (None, None, None, None);
    (*largest_effort, *force_n) = (None, None);
    presses.clear();
    if let Some(FingerReport { state, target_rad: _, measured_rad: _ }) = fingers {
        *state = None;
    }
}

impl Session {
    /// Checks that no caller's call shows withheld information.
    pub(super) fn allow<'a>(&self, called: &'a Called) -> Result<Allowed<'a>, EpisodeError> {
        called.allowed(|tool| self.check_told(tool))
    }

    /// Refuses setpoints of motors where the executed commands differ from the policy's.
    fn check_drives(&self, call: &ToolCall) -> Result<(), EpisodeError> {
        match call {
            ToolCall::Act(ActCall::SendJointDrives(_)) if self.execution.is_some() => {
                let reason = "this episode's robots execute commands otherwise than told (stress, or disturb), which setpoints of motors do not show; use send_joint_chunk";
                Err(SpecError::Invalid { tool: call.name(), reason: reason.into() }.into())
            }
            _ => Ok(()),
        }
    }

    /// Refuses a call that would show withheld information, or that this episode cannot carry out.
    pub(super) fn check_told(&self, call: &ToolCall) -> Result<(), EpisodeError> {
        self.check_drives(call)?;
        let refused = |reason: &str| {
            EpisodeError::Spec(SpecError::Invalid { tool: call.name(), reason: reason.into() })
        };
        let is_paper = self.spec().assistance == Assistance::Paper;
        let frames: Vec<Option<PoseFrame>> = match call {
            ToolCall::Plan(_) if is_paper => {
                return Err(refused(
                    "this episode has no plans; command by move_wrists, walk, wait and send_joint_chunk",
                ));
            }
            ToolCall::Plan(_) => Vec::new(),
            ToolCall::Look(LookCall::QueryDepth(args)) if args.surface.is_some() && is_paper => {
                return Err(refused("this episode measures at pixels alone; give pixels or region"));
            }
            ToolCall::Manage(ManageCall::GetStatus(args)) if args.explain && is_paper => {
                return Err(refused("this episode does not tell what phases lack; leave explain out"));
            }
            ToolCall::Look(LookCall::QueryDepth(args)) if args.fit && is_paper => {
                return Err(refused("this episode measures at pixels alone; leave fit out"));
            }
            ToolCall::Look(LookCall::QueryDepth(args)) => vec![Some(args.frame)],
            ToolCall::Look(LookCall::CheckReach(args)) => vec![args.frame],
            ToolCall::Act(ActCall::MoveWrists(args))
                if is_paper
                    && args
                        .robots
                        .iter()
                        .any(|entry| [entry.keep_waist, entry.stand_fast].contains(&Some(true))) =>
            {
                return Err(refused(
                    "this episode's robots turn and step as reaching needs; leave keep_waist and stand_fast out",
                ));
            }
            ToolCall::Act(ActCall::MoveWrists(args)) => args.robots.iter().map(|entry| entry.frame).collect(),
            ToolCall::Look(LookCall::Observe(args)) if args.depth_image && is_paper => {
                return Err(refused(
                    "this episode shows no images of depth; leave depth_image out, and measure with query_depth",
                ));
            }
            ToolCall::Look(LookCall::Observe(args)) => vec![args.frame],
            ToolCall::Look(LookCall::GetRobotState(args)) => vec![Some(args.frame)],
            ToolCall::Act(
                ActCall::Walk(_)
                | ActCall::SendJointChunk(_)
                | ActCall::SendJointDrives(_)
                | ActCall::Wait(_),
            )
            | ToolCall::Manage(_)
            | ToolCall::Talk(_) => Vec::new(),
        };
        let other = frames.into_iter().flatten().find(|frame| *frame != PoseFrame::Pelvis);
        match (self.spec().assistance, other) {
            (Assistance::Paper, Some(_)) => {
                Err(refused("this episode tells of poses in the pelvis frame alone; leave frame out"))
            }
            (Assistance::Paper | Assistance::Full, _) => Ok(()),
        }
    }
}
