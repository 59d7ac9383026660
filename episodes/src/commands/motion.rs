//! Motion of one robot: its joint targets, and the inverse kinematics with which they follow wrist poses.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use tandem_ik::{Configuration, FrameError, Outcome, Solver, Tolerance, frame_errors};
use tandem_sim::{
    BaseCommand, BaseLimits, CONTROL_HZ, HAND_JOINTS, MotorSetpoints, RobotCommand, RobotModel, RobotSensed,
    Side, Sides, UPPER, UPPER_JOINTS,
};
use tandem_tools_spec::PoseFrame;

use super::aim::{Aim, WristPoses};
use super::columns;
use super::footing::Footing;
use super::upper_body::{STEPS_AHEAD_M, UpperBody, ahead_m};
use crate::convert::isometry_from_sim;

/// Fraction of the remaining error removed in one control step: smooth, with a lag of two steps.
const GAIN: f64 = 0.5;
/// Number of control steps after which wrists are as close to their targets as they can get.
const GOING_STEPS: u32 = 75;
/// Limits of yielding. Hands creep back at `LEAK_1_S` while they may yield, and return at `RETURN_1_S`
/// otherwise.
const MAX_YIELD_M: f64 = 0.06;
const MAX_YIELD_RAD: f64 = 0.15;
const LEAK_1_S: f64 = 0.1;
const RETURN_1_S: f64 = 3.0;
/// Distance in metres that counts as much as one radian of rotation in the distance to a wrist's target.
const M_PER_RAD: f64 = 0.1;
/// Weight of one control step in the running mean of the distance.
const LATELY_PART: f64 = 0.1;
/// Minimum decrease of an approaching wrist's distance, absolute and relative; smaller changes are sway.
const NEARER_M: f64 = 0.003;
const NEARER_PART: f64 = 0.15;
/// Minimum yielding that is reported, in metres or radians.
const MIN_REPORTED: f64 = 0.003;

/// Per-robot constants of an episode.
#[derive(Clone)]
pub struct RobotSheet {
    pub name: String,
    pub model: Arc<RobotModel>,
    /// Limits of the base commands that its controller follows.
    pub base_limits: BaseLimits,
    /// Pose of the room frame in the first robot's start frame.
    pub start_from_room: Isometry3<f64>,
}

/// Motion of one robot.
pub struct Motion {
    pub robot: RobotSheet,
    body: Arc<UpperBody>,
    solver: Solver,
    state: MotionState,
}

/// State of a motion that persists between control steps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MotionState {
    /// Joint targets of the current control step, in action order.
    pub(super) upper_rad: [f64; UPPER_JOINTS],
    pub(super) base: BaseCommand,
    pub(super) aims: Sides<Aim>,
    pub(super) restraint: Restraint,
    /// Latest sensed pose of the pelvis.
    world_from_pelvis: Isometry3<f64>,
    /// Latest sensed load on both hands: forces forward and to the left, and moment about the vertical
    /// through the hands' midpoint.
    pull_n: [f64; 2],
    turning_n_m: f64,
    /// Displacement of the hands caused by yielding to each of these loads.
    yielded_m: [f64; 2],
    yielded_rad: f64,
    /// The solver's memory of steps that did not help; see [`Solver::caution`].
    caution: f64,
    /// Current and recent distances of the wrists from their targets; `None` before the first reading.
    pub(super) approaches: Sides<Option<Approach>>,
    pub(super) footing: Footing,
    /// Frame of the latest wrist targets, in which reports have the wrists.
    #[serde(default)]
    pub(super) frame: PoseFrame,
    /// Setpoints of the motors in the current control step; empty while drives and base controller follow
    /// joint targets and base command.
    setpoints: Vec<MotorSetpoints>,
}

/// Restrictions on arms that move to their aims.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Restraint {
    /// True to hold the waist's joint angles.
    pub keeps_waist: bool,
    /// True to stop before the robot has to step.
    pub stands_fast: bool,
}

/// Distance of a wrist from its target in metres; a radian counts as a tenth of a metre.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Approach {
    missing_m: f64,
    /// Running mean of the distance over about a fifth of a second.
    lately_m: f64,
}

/// Predicted end state of a reach.
pub struct Reach {
    /// Predicted error of each wrist with a target.
    pub errors: Sides<Option<FrameError>>,
    /// Joints that would be at their limits.
    pub joints_at_limit: Vec<String>,
    /// True if the reach moves the robot's centre of mass beyond the limit, and farther than now.
    pub has_to_step: bool,
}

/// Force at which the pair of hands moves at 1 m/s, or moment at which it turns at 1 rad/s; `None` if stiff.
#[derive(Clone, Copy, Debug, Default)]
pub struct Compliance {
    pub ahead_n_s_m: Option<f64>,
    pub side_n_s_m: Option<f64>,
    pub turn_n_m_s_rad: Option<f64>,
}

impl Compliance {
    pub const NONE: Compliance = Compliance { ahead_n_s_m: None, side_n_s_m: None, turn_n_m_s_rad: None };
}

impl Motion {
    /// Returns the motion of a robot that stands under the command `rest`, with its pelvis at
    /// `world_from_pelvis`.
    pub fn new(
        robot: RobotSheet,
        body: &Arc<UpperBody>,
        rest: &RobotCommand,
        world_from_pelvis: Isometry3<f64>,
    ) -> Motion {
        let state = MotionState {
            upper_rad: rest.upper_rad.map(f64::from),
            base: rest.base,
            aims: Sides::both(Aim::Joints),
            restraint: Restraint::default(),
            world_from_pelvis,
            pull_n: [0.0; 2],
            turning_n_m: 0.0,
            yielded_m: [0.0; 2],
            yielded_rad: 0.0,
            caution: 1.0,
            approaches: Sides::both(None),
            footing: Footing::new(world_from_pelvis),
            frame: PoseFrame::default(),
            setpoints: Vec::new(),
        };
        Motion { robot, solver: body.solver(), body: body.clone(), state }
    }

    /// Sets the pelvis, and the world's force on each hand (world frame), until the next reading.
    pub fn sense(&mut self, world_from_pelvis: Isometry3<f64>, hands_n: Sides<Vector3<f64>>) {
        self.state.world_from_pelvis = world_from_pelvis;
        let wrists = self.commanded_wrists();
        let apart_m = world_from_pelvis * wrists.left.translation.vector
            - world_from_pelvis * wrists.right.translation.vector;
        let pull_n = self.heading().inverse() * (hands_n.left + hands_n.right);
        self.state.pull_n = [pull_n.x, pull_n.y];
        self.state.turning_n_m = 0.5 * apart_m.cross(&(hands_n.left - hands_n.right)).z;
    }

    /// Updates the reported state from the robot's sensor readings after a control step.
    pub fn feel(&mut self, sensed: &RobotSensed) {
        if !self.state.setpoints.is_empty() {
            self.stay_where(sensed);
        }
        let targets = self.yielded(&self.state.aims);
        let before = &self.state.approaches;
        self.state.approaches = Sides::from_fn(|side| {
            let off = isometry_from_sim(&sensed.pelvis_from_wrist[side]).inv_mul(&targets[side]?);
            let turned_rad = if self.body.turns_hand[side] { off.rotation.angle() } else { 0.0 };
            let missing_m = off.translation.vector.norm() + M_PER_RAD * turned_rad;
            let lately_m = before[side].map_or(missing_m, |before| before.lately_m);
            Some(Approach { missing_m, lately_m: lately_m + LATELY_PART * (missing_m - lately_m) })
        });
        let MotionState { footing, base, world_from_pelvis, .. } = &mut self.state;
        footing.feel(sensed, base, world_from_pelvis);
    }

    /// Returns the pose of a frame in the pelvis frame.
    pub fn pelvis_from(&self, frame: PoseFrame) -> Isometry3<f64> {
        let pelvis = &self.state.world_from_pelvis;
        match frame {
            PoseFrame::Pelvis => Isometry3::identity(),
            PoseFrame::Level => {
                Isometry3::from_parts(Translation3::identity(), pelvis.rotation.inverse() * self.heading())
            }
            PoseFrame::Start => self.state.footing.pelvis_from_start,
            PoseFrame::Room => self.state.footing.pelvis_from_start * self.robot.start_from_room,
        }
    }

    /// Returns the heading: level, with x in the robot's forward direction.
    pub(super) fn heading(&self) -> UnitQuaternion<f64> {
        let ahead = self.state.world_from_pelvis.rotation * Vector3::x();
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), ahead.y.atan2(ahead.x))
    }

    /// Advances the yielding of the hands by one control step. Without compliance, they return to their
    /// targets.
    ///   dy/dt = F / c - l y,   |y| <= y_max
    pub(super) fn advance_yielding(&mut self, compliance: Compliance) {
        let Compliance { ahead_n_s_m, side_n_s_m, turn_n_m_s_rad } = compliance;
        let MotionState { pull_n, turning_n_m, yielded_m, yielded_rad, .. } = &mut self.state;
        let one = |yielded: &mut f64, pull: f64, damping: Option<f64>, most: f64| {
            let rate = damping.map_or(-RETURN_1_S * *yielded, |damping| pull / damping - LEAK_1_S * *yielded);
            *yielded = (*yielded + rate / CONTROL_HZ).clamp(-most, most);
        };
        let [ahead_m, left_m] = yielded_m;
        one(ahead_m, pull_n[0], ahead_n_s_m, MAX_YIELD_M);
        one(left_m, pull_n[1], side_n_s_m, MAX_YIELD_M);
        one(yielded_rad, *turning_n_m, turn_n_m_s_rad, MAX_YIELD_RAD);
    }

    /// Returns the transform from commanded to yielded wrists (pelvis frame), about their commanded middle.
    fn yielding(&self, middle_m: Vector3<f64>) -> Isometry3<f64> {
        let pelvis_from_world = self.state.world_from_pelvis.rotation.inverse();
        let up = pelvis_from_world * Vector3::z_axis();
        let turned = UnitQuaternion::from_axis_angle(&up, self.state.yielded_rad);
        Translation3::from(self.yielding_m()) * Isometry3::rotation_wrt_point(turned, Point3::from(middle_m))
    }

    /// Returns the displacement of the wrists' midpoint by yielding, in the pelvis frame.
    fn yielding_m(&self) -> Vector3<f64> {
        let [ahead_m, left_m] = self.state.yielded_m;
        let level_m = self.heading() * Vector3::new(ahead_m, left_m, 0.0);
        self.state.world_from_pelvis.rotation.inverse() * level_m
    }

    /// Returns the midpoint of `commanded` wrists without the yielding, in the pelvis frame.
    fn unyielded_middle_m(&self, commanded: &Sides<Isometry3<f64>>) -> Vector3<f64> {
        middle_m(&commanded.left, &commanded.right) - self.yielding_m()
    }

    pub fn world_from_pelvis(&self) -> &Isometry3<f64> {
        &self.state.world_from_pelvis
    }

    pub fn state(&self) -> &MotionState {
        &self.state
    }

    /// Returns the joint targets of waist, arms and hands in radians.
    pub fn upper_rad(&self) -> &[f64; UPPER_JOINTS] {
        &self.state.upper_rad
    }

    pub fn set_state(&mut self, state: MotionState) {
        self.state = state;
    }

    /// Returns the motion of an identical robot in the same state.
    pub fn another(&self) -> Motion {
        Motion {
            robot: self.robot.clone(),
            solver: self.body.solver(),
            body: self.body.clone(),
            state: self.state.clone(),
        }
    }

    /// Returns the state of an identical robot after `command`; the hands' poses follow from the joint
    /// targets.
    pub fn state_after(&self, command: &RobotCommand, world_from_pelvis: Isometry3<f64>) -> MotionState {
        Motion::new(self.robot.clone(), &self.body, command, world_from_pelvis).state
    }

    /// Returns true if a wrist has a pose as its aim, not joint angles.
    pub fn aims_at_pose(&self, side: Side) -> bool {
        self.state.aims[side] != Aim::Joints
    }

    /// Returns the current command.
    pub fn command(&self) -> RobotCommand {
        RobotCommand {
            upper_rad: self.state.upper_rad.map(|target_rad| target_rad as f32),
            base: self.state.base,
        }
    }

    /// Returns the base command for a velocity (forward and left in m/s, yaw rate in rad/s) and a height.
    /// Without a height, the base keeps the previous one.
    pub(super) fn base_command(&self, velocity_command: [f64; 3], height_m: Option<f64>) -> BaseCommand {
        let [vx_m_s, vy_m_s, yaw_rate_rad_s] = velocity_command.map(|part| part as f32);
        let pelvis_height_m = height_m.map_or(self.state.base.pelvis_height_m, |height_m| height_m as f32);
        BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m }
    }

    /// Returns the wrist poses that follow from the present aims and joint targets.
    pub fn wrists(&self) -> Sides<WristPoses> {
        let MotionState { aims, world_from_pelvis, .. } = &self.state;
        let commanded = self.commanded_wrists();
        let unyielding = self.yielding(self.unyielded_middle_m(&commanded)).inverse();
        let yielded = self.yielded(aims);
        Sides::from_fn(|side| {
            let commanded = commanded[side];
            let unyielded = unyielding * commanded;
            WristPoses {
                target: aims[side].in_pelvis(world_from_pelvis).unwrap_or(unyielded),
                yielded: yielded[side].unwrap_or(commanded),
                commanded,
                unyielded,
            }
        })
    }

    /// Begins a command that has a separate report.
    pub fn begin_command(&mut self) {
        self.state.footing.begin();
    }

    /// Returns true if the hands have yielded by enough for reports.
    pub(super) fn has_yielded(&self) -> bool {
        let MotionState { yielded_m: [ahead_m, left_m], yielded_rad, .. } = &self.state;
        ahead_m.abs().max(left_m.abs()).max(yielded_rad.abs()) > MIN_REPORTED
    }

    /// Returns true if a wrist approaches its target; `None` while this is unknown.
    pub(super) fn comes_nearer(&self, side: Side) -> Option<bool> {
        let Approach { missing_m, lately_m } = self.state.approaches[side]?;
        (missing_m != lately_m).then_some(lately_m - missing_m > NEARER_M.max(NEARER_PART * missing_m))
    }

    /// Commands the base to stand at its previous height.
    pub(super) fn stand(&mut self) {
        let pelvis_height_m = self.state.base.pelvis_height_m;
        self.state.base = BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m };
    }

    /// Returns the motor setpoints of the current control step, which replace the robot's command. The slice
    /// is empty without setpoints.
    pub fn setpoints(&self) -> &[MotorSetpoints] {
        &self.state.setpoints
    }

    /// Drives the motors in the current control step.
    pub(super) fn drive(&mut self, setpoints: &[MotorSetpoints]) {
        self.keep_joints();
        self.state.setpoints = setpoints.to_vec();
    }

    /// Keeps the last setpoints of the motors. Returns false if there are none.
    pub(super) fn keep_driving(&mut self) -> bool {
        let last = self.state.setpoints.len().saturating_sub(1);
        self.state.setpoints.drain(..last);
        !self.state.setpoints.is_empty()
    }

    /// Returns control of a robot with driven motors to its controller, which keeps the present posture.
    pub(super) fn hand_back(&mut self) {
        self.state.setpoints.clear();
    }

    /// Sets the targets that keep the robot in its present posture and place.
    fn stay_where(&mut self, sensed: &RobotSensed) {
        let joint_rad = |column: usize| {
            let joint = &self.robot.model.joints[UPPER[column]];
            sensed.joints.q_rad[UPPER[column]].clamp(joint.lower_rad, joint.upper_rad).into()
        };
        self.state.upper_rad = std::array::from_fn(joint_rad);
        let base = BaseCommand::standing(sensed.start_from_pelvis.translation.z);
        self.state.base = self.robot.base_limits.clamp(base);
    }

    pub(super) fn walk(&mut self, base: BaseCommand) {
        self.state.base = base;
    }

    /// Sets the aims of the wrists, the restrictions on the arms, and the frame of reports.
    pub(super) fn aim(&mut self, aims: Sides<Aim>, restraint: Restraint, frame: PoseFrame) {
        (self.state.aims, self.state.restraint, self.state.frame) = (aims, restraint, frame);
        self.state.approaches = Sides::both(None);
    }

    /// Lets both arms keep their joints.
    pub(super) fn keep_joints(&mut self) {
        self.aim(Sides::both(Aim::Joints), Restraint::default(), PoseFrame::Pelvis);
    }

    pub(super) fn set_joints(&mut self, upper_rad: [f64; UPPER_JOINTS]) {
        self.state.upper_rad = upper_rad;
        (self.state.aims, self.state.frame) = (Sides::both(Aim::Joints), PoseFrame::Pelvis);
    }

    pub(super) fn turn_waist(&mut self, column: usize, target_rad: f64) {
        self.state.upper_rad[column] = target_rad;
    }

    pub(super) fn set_fingers(&mut self, side: Side, fingers_rad: &[f64; HAND_JOINTS]) {
        self.state.upper_rad[columns::hand(side)].copy_from_slice(fingers_rad);
    }

    /// Returns the wrist poses under the commanded joints, in the pelvis frame.
    fn commanded_wrists(&self) -> Sides<Isometry3<f64>> {
        let configuration = self.configuration();
        self.body.wrists.map(|wrist| configuration.root_from_frame(wrist))
    }

    /// Moves the joint targets by one step towards `aims`; an arm without a target keeps its joints. Inverse
    /// kinematics starts at the commanded joints, so the sag under gravity does not accumulate.
    pub(super) fn follow(&mut self, aims: &Sides<Aim>) {
        let targets = self.yielded(aims);
        if targets == Sides::both(None) {
            return;
        }
        let body = self.body.clone();
        let tasks = body.tasks(&targets, GAIN);
        let mut configuration = configuration(&body, &self.state);
        let Restraint { keeps_waist, stands_fast } = self.state.restraint;
        self.solver.limits.velocity = body.speeds_rad_s(&targets, keeps_waist);
        self.solver.caution = self.state.caution;
        if let Outcome::Infeasible { .. } = self.solver.track(&mut configuration, &tasks, &[]) {
            // Shapes that already overlap can contradict each other; the joints must still get out.
            let barrier = self.solver.self_collision.take();
            self.solver.track(&mut configuration, &tasks, &[]);
            self.solver.self_collision = barrier;
        }
        self.state.caution = self.solver.caution;
        let mut upper_rad = self.state.upper_rad;
        for (column, q) in body.columns.iter().zip(configuration.q()) {
            upper_rad[*column] = *q;
        }
        if !(stands_fast && self.has_to_step(&upper_rad)) {
            self.state.upper_rad = upper_rad;
        }
    }

    /// Returns true if these joint targets move the centre of mass beyond the limit, and farther than now.
    fn has_to_step(&self, upper_rad: &[f64; UPPER_JOINTS]) -> bool {
        let ahead_m = self.ahead_m(upper_rad);
        ahead_m > STEPS_AHEAD_M && ahead_m > self.ahead_m(&self.state.upper_rad)
    }

    /// Returns the forward displacement of the whole robot's centre of mass from rest under these joint
    /// targets.
    fn ahead_m(&self, upper_rad: &[f64; UPPER_JOINTS]) -> f64 {
        ahead_m(&self.robot.model, upper_rad) - self.body.rest_ahead_m(&self.robot.model)
    }

    /// Returns the tolerance within which a wrist has reached its target.
    pub fn tolerance(&self, side: Side) -> Tolerance {
        self.body.tolerance(side)
    }

    /// Predicts the rest poses for `targets` (pelvis frame). The joints of an arm without a target do not
    /// move.
    pub fn reach(&self, targets: &Sides<Option<Isometry3<f64>>>, keeps_waist: bool) -> Reach {
        let speeds_rad_s = self.body.speeds_rad_s(targets, keeps_waist);
        let tasks = self.body.tasks(targets, 1.0);
        // A command moves there step by step, and leaves the trunk more upright than the direct solution.
        let mut twin = self.another();
        twin.state.restraint = Restraint { keeps_waist, stands_fast: false };
        let aims = targets.map(|target| target.map_or(Aim::Joints, Aim::Carried));
        (0..GOING_STEPS).for_each(|_| twin.follow(&aims));
        let mut moved = targets.by_side().filter(|(_, target)| target.is_some());
        let configuration = match moved.all(|(side, _)| self.body.turns_hand[side]) {
            true => self.body.posture(self.configuration(), &tasks, &speeds_rad_s),
            // The direct solution would sacrifice the position of a limited arm to the orientation.
            false => twin.configuration(),
        };
        let mut errors = frame_errors(&configuration, &tasks);
        let errors = targets.each_ref().map(|target| target.as_ref().and_then(|_| errors.next()));
        let at_limit = tandem_ik::saturated(&configuration).into_iter();
        let at_limit = at_limit.filter(|joint| speeds_rad_s[*joint] > 0.0);
        let joints_at_limit = at_limit.map(|joint| self.body.model.joints()[joint].name.clone()).collect();
        Reach { errors, joints_at_limit, has_to_step: self.has_to_step(&twin.state.upper_rad) }
    }

    /// Returns the poses of `aims` with the yielding, in the pelvis frame; `None` for joints.
    fn yielded(&self, aims: &Sides<Aim>) -> Sides<Option<Isometry3<f64>>> {
        let targets = aims.map(|aim| aim.in_pelvis(&self.state.world_from_pelvis));
        let middle_m = match (targets.left, targets.right) {
            (Some(left), Some(right)) => middle_m(&left, &right),
            (None, _) | (_, None) => self.unyielded_middle_m(&self.commanded_wrists()),
        };
        let yielding = self.yielding(middle_m);
        targets.map(|target| target.map(|wrist| yielding * wrist))
    }

    fn configuration(&self) -> Configuration<'_> {
        configuration(&self.body, &self.state)
    }
}

fn middle_m(left: &Isometry3<f64>, right: &Isometry3<f64>) -> Vector3<f64> {
    0.5 * (left.translation.vector + right.translation.vector)
}

fn configuration<'a>(body: &'a UpperBody, state: &MotionState) -> Configuration<'a> {
    let q: Vec<f64> = body.columns.iter().map(|column| state.upper_rad[*column]).collect();
    Configuration::new(&body.model, &q).expect("one finite target per joint")
}
