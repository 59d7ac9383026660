//! What moves one robot: its joint targets, and the inverse kinematics that makes them follow wrist poses.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use tandem_ik::{Configuration, FrameError, Outcome, Solver, Tolerance, frame_errors};
use tandem_sim::{
    BaseCommand, BaseLimits, CONTROL_HZ, HAND_JOINTS, RobotCommand, RobotModel, RobotSensed, Side, Sides,
    UPPER_JOINTS,
};
use tandem_tools_spec::PoseFrame;

use super::columns;
use super::footing::Footing;
use super::upper_body::{STEPS_AHEAD_M, UpperBody, ahead_m};
use crate::convert::isometry_from_sim;

/// Part of the remaining error that one control step removes: smooth, and a lag of two steps.
const GAIN: f64 = 0.5;
/// Control steps in which wrists come to where they can.
const GOING_STEPS: u32 = 75;
/// Hands give way by no more than this ahead and to the side (m) and about the vertical (rad). They creep back at this rate while they may
/// give way, faster when they may no more.
const MAX_YIELD_M: f64 = 0.06;
const MAX_YIELD_RAD: f64 = 0.15;
const LEAK_1_S: f64 = 0.1;
const RETURN_1_S: f64 = 3.0;
/// Of what is missing to a wrist's target, in metres, a radian counts for this.
const M_PER_RAD: f64 = 0.1;
/// Part of the mean that one control step makes up.
const LATELY_PART: f64 = 0.1;
/// A wrist comes nearer that is nearer than it was lately by this much, or by this part of what is missing; less is swaying.
const NEARER_M: f64 = 0.003;
const NEARER_PART: f64 = 0.15;
/// A hand that has given way by less is where it was told to be: metres or radians.
const MIN_REPORTED: f64 = 0.003;

/// What of a robot stays the same throughout an episode.
#[derive(Clone)]
pub struct RobotSheet {
    pub name: String,
    pub model: Arc<RobotModel>,
    /// Base commands that its controller follows.
    pub base_limits: BaseLimits,
}

/// What moves one robot.
pub struct Motion {
    pub robot: RobotSheet,
    body: Arc<UpperBody>,
    solver: Solver,
    state: MotionState,
}

/// What one robot was last told: all of a motion that outlasts a control step.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MotionState {
    /// Joint targets of the present control step, action order.
    pub(super) upper_rad: [f64; UPPER_JOINTS],
    pub(super) base: BaseCommand,
    pub(super) aims: Sides<Aim>,
    pub(super) restraint: Restraint,
    /// The pelvis as it was last sensed.
    world_from_pelvis: Isometry3<f64>,
    /// What pulled the pair of hands, as it was last sensed: the way the robot faces and to its left, and about the vertical through the
    /// middle between the wrists.
    pull_n: [f64; 2],
    turning_n_m: f64,
    /// How far the hands have given way to each.
    yielded_m: [f64; 2],
    yielded_rad: f64,
    /// What the solver remembers of steps that did not help; see [`Solver::caution`].
    caution: f64,
    /// How far each wrist is from its target, and how far it was a moment ago; `None` before it has been seen under its present aim.
    pub(super) approaches: Sides<Option<Approach>>,
    pub(super) footing: Footing,
}

/// What arms may not do that reach for their aims.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Restraint {
    /// Turn or bend the waist.
    pub keeps_waist: bool,
    /// Go so far ahead that the robot has to step.
    pub stands_fast: bool,
}

/// How a wrist nears its target: metres, of which a radian of its turning counts as a tenth.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Approach {
    missing_m: f64,
    /// The mean of what it was, over the last fifth of a second or so.
    lately_m: f64,
}

/// How arms would come to rest.
pub struct Reach {
    /// What each wrist that has a target would be off.
    pub errors: Sides<Option<FrameError>>,
    /// Joints that would be at their limits.
    pub joints_at_limit: Vec<String>,
    /// How much farther ahead the whole robot's centre of mass would be than with its arms at rest.
    pub ahead_m: f64,
}

/// How the pair of hands gives way to what pulls it: the force under which it goes at 1 m/s, or the moment under which it turns at
/// 1 rad/s; `None` for not at all.
#[derive(Clone, Copy, Debug, Default)]
pub struct Compliance {
    pub ahead_n_s_m: Option<f64>,
    pub side_n_s_m: Option<f64>,
    pub turn_n_m_s_rad: Option<f64>,
}

impl Compliance {
    pub const NONE: Compliance = Compliance { ahead_n_s_m: None, side_n_s_m: None, turn_n_m_s_rad: None };
}

/// What a wrist is to do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Aim {
    /// The arm's joints stay as they are.
    Joints,
    /// A pose in the world: the hand stays there while the pelvis sways or walks.
    World(Isometry3<f64>),
    /// A pose in the pelvis frame, which goes where the pelvis goes.
    Carried(Isometry3<f64>),
}

impl Motion {
    /// A robot that stands under `rest`, with its pelvis at `world_from_pelvis`.
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
        };
        Motion { robot, solver: body.solver(), body: body.clone(), state }
    }

    /// What the robot's hands are steered by until it is sensed anew: the pelvis, and the force of the world on each hand (world frame).
    pub fn sense(&mut self, world_from_pelvis: Isometry3<f64>, hands_n: Sides<Vector3<f64>>) {
        self.state.world_from_pelvis = world_from_pelvis;
        let wrists = self.commanded_wrists();
        let apart_m = world_from_pelvis * wrists.left.translation.vector
            - world_from_pelvis * wrists.right.translation.vector;
        let pull_n = self.heading().inverse() * (hands_n.left + hands_n.right);
        self.state.pull_n = [pull_n.x, pull_n.y];
        self.state.turning_n_m = 0.5 * apart_m.cross(&(hands_n.left - hands_n.right)).z;
    }

    /// Takes in what the robot senses after a control step, for what is told of it.
    pub fn feel(&mut self, sensed: &RobotSensed) {
        let asked = self.asked_wrists();
        let before = &self.state.approaches;
        self.state.approaches = Sides::from_fn(|side| {
            let off = isometry_from_sim(&sensed.pelvis_from_wrist[side]).inv_mul(&asked[side]?);
            let turned_rad = if self.body.turns_hand[side] { off.rotation.angle() } else { 0.0 };
            let missing_m = off.translation.vector.norm() + M_PER_RAD * turned_rad;
            let lately_m = before[side].map_or(missing_m, |before| before.lately_m);
            Some(Approach { missing_m, lately_m: lately_m + LATELY_PART * (missing_m - lately_m) })
        });
        let MotionState { footing, base, world_from_pelvis, .. } = &mut self.state;
        footing.feel(sensed, base, world_from_pelvis);
    }

    /// From a frame in which poses may be given to the pelvis.
    pub fn pelvis_from(&self, frame: PoseFrame) -> Isometry3<f64> {
        let pelvis = &self.state.world_from_pelvis;
        match frame {
            PoseFrame::Pelvis => Isometry3::identity(),
            PoseFrame::Level => {
                Isometry3::from_parts(Translation3::identity(), pelvis.rotation.inverse() * self.heading())
            }
            PoseFrame::Start => self.state.footing.pelvis_from_start,
        }
    }

    /// Level, x the way the robot faces.
    pub(super) fn heading(&self) -> UnitQuaternion<f64> {
        let ahead = self.state.world_from_pelvis.rotation * Vector3::x();
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), ahead.y.atan2(ahead.x))
    }

    /// Hands give way for one control step; where they must not, they come back to where they were told to be.
    ///   dy/dt = F / c - l y,   |y| <= y_max
    pub(super) fn give_way(&mut self, compliance: Compliance) {
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

    /// From wrists as they were told to be to where they have given way to, if the middle between them was told to be at `middle_m`
    /// (pelvis frame). It turns them about this middle.
    fn yielding(&self, middle_m: Vector3<f64>) -> Isometry3<f64> {
        let pelvis_from_world = self.state.world_from_pelvis.rotation.inverse();
        let up = pelvis_from_world * Vector3::z_axis();
        let turned = UnitQuaternion::from_axis_angle(&up, self.state.yielded_rad);
        Translation3::from(self.yielded_m()) * Isometry3::rotation_wrt_point(turned, Point3::from(middle_m))
    }

    /// How far the middle between the wrists has given way, pelvis frame.
    fn yielded_m(&self) -> Vector3<f64> {
        let [ahead_m, left_m] = self.state.yielded_m;
        let level_m = self.heading() * Vector3::new(ahead_m, left_m, 0.0);
        self.state.world_from_pelvis.rotation.inverse() * level_m
    }

    /// Where the commanded joints would put the middle between the wrists had it not given way, pelvis frame.
    fn commanded_middle_m(&self) -> Vector3<f64> {
        let wrists = self.commanded_wrists();
        0.5 * (wrists.left.translation.vector + wrists.right.translation.vector) - self.yielded_m()
    }

    pub fn world_from_pelvis(&self) -> &Isometry3<f64> {
        &self.state.world_from_pelvis
    }

    pub fn state(&self) -> &MotionState {
        &self.state
    }

    /// Joint targets of waist, arms and hands in radians.
    pub fn upper_rad(&self) -> &[f64; UPPER_JOINTS] {
        &self.state.upper_rad
    }

    pub fn set_state(&mut self, state: MotionState) {
        self.state = state;
    }

    /// What moves a robot like this one that is told the same.
    pub fn another(&self) -> Motion {
        Motion {
            robot: self.robot.clone(),
            solver: self.body.solver(),
            body: self.body.clone(),
            state: self.state.clone(),
        }
    }

    /// The state of a robot like this one that was last told `command`, with its pelvis at `world_from_pelvis`: of its hands it is
    /// known where the joints were to have them.
    pub fn told(&self, command: &RobotCommand, world_from_pelvis: Isometry3<f64>) -> MotionState {
        Motion::new(self.robot.clone(), &self.body, command, world_from_pelvis).state
    }

    /// Whether a wrist is to be at a pose, and its arm not only at joint angles.
    pub fn aims_at_pose(&self, side: Side) -> bool {
        self.state.aims[side] != Aim::Joints
    }

    /// What the robot is told now.
    pub fn command(&self) -> RobotCommand {
        RobotCommand {
            upper_rad: self.state.upper_rad.map(|target_rad| target_rad as f32),
            base: self.state.base,
        }
    }

    /// The base command that a velocity (forward and left in m/s, turning in rad/s) and a height ask for. Without a height, the base
    /// keeps the one that it was last told.
    pub(super) fn base_asked(&self, velocity_command: [f64; 3], height_m: Option<f64>) -> BaseCommand {
        let [vx_m_s, vy_m_s, yaw_rate_rad_s] = velocity_command.map(|part| part as f32);
        let pelvis_height_m = height_m.map_or(self.state.base.pelvis_height_m, |height_m| height_m as f32);
        BaseCommand { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m }
    }

    /// Where the wrists are to be, in the frame of the pelvis as it is now; of an arm without a target, where its joints
    /// have the wrist.
    pub fn targets(&self) -> Sides<Isometry3<f64>> {
        let commanded = self.commanded_wrists();
        let asked = self.in_pelvis(&self.state.aims);
        Sides::from_fn(|side| asked[side].unwrap_or(commanded[side]))
    }

    /// As [`Motion::targets`], as they were told and not as they have given way since.
    pub fn told_wrists(&self) -> Sides<Isometry3<f64>> {
        let as_told = self.yielding(self.commanded_middle_m()).inverse();
        let commanded = self.commanded_wrists().map(|wrist| as_told * wrist);
        let pelvis = &self.state.world_from_pelvis;
        Sides::from_fn(|side| self.state.aims[side].in_pelvis(pelvis).unwrap_or(commanded[side]))
    }

    /// A command begins that is told of by itself.
    pub fn begin_command(&mut self) {
        self.state.footing.begin();
    }

    /// Where the wrists that have targets are to be, pelvis frame.
    fn asked_wrists(&self) -> Sides<Option<Isometry3<f64>>> {
        self.in_pelvis(&self.state.aims)
    }

    /// How far hands have given way, pelvis frame; `None` where they have not.
    pub(super) fn given_way_m(&self, side: Side) -> Option<Vector3<f64>> {
        let MotionState { yielded_m, yielded_rad, aims, .. } = &self.state;
        let [ahead_m, left_m] = *yielded_m;
        let most = ahead_m.abs().max(left_m.abs()).max(yielded_rad.abs());
        let asked = aims[side].in_pelvis(&self.state.world_from_pelvis).filter(|_| most > MIN_REPORTED)?;
        let given_way = self.asked_wrists()[side]?;
        Some(given_way.translation.vector - asked.translation.vector)
    }

    /// Whether a wrist comes nearer to its target; `None` where that cannot be told yet.
    pub(super) fn comes_nearer(&self, side: Side) -> Option<bool> {
        let Approach { missing_m, lately_m } = self.state.approaches[side]?;
        (missing_m != lately_m).then_some(lately_m - missing_m > NEARER_M.max(NEARER_PART * missing_m))
    }

    /// The base stands at the height that it was last told.
    pub(super) fn stand(&mut self) {
        let pelvis_height_m = self.state.base.pelvis_height_m;
        self.state.base = BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m };
    }

    pub(super) fn walk(&mut self, base: BaseCommand) {
        self.state.base = base;
    }

    /// What the wrists are to do from now on, and how.
    pub(super) fn aim(&mut self, aims: Sides<Aim>, restraint: Restraint) {
        self.state.aims = aims;
        self.state.restraint = restraint;
        self.state.approaches = Sides::both(None);
    }

    /// Both arms keep their joints until they are told otherwise.
    pub(super) fn keep_joints(&mut self) {
        self.aim(Sides::both(Aim::Joints), Restraint::default());
    }

    /// Aims of the kind of those in force, at which the wrists would have arrived were they where the commanded joints put them and had
    /// they not given way.
    pub(super) fn arrived(&self) -> Sides<Aim> {
        let as_told = self.yielding(self.commanded_middle_m()).inverse();
        let commanded = self.commanded_wrists().map(|wrist| as_told * wrist);
        Sides::from_fn(|side| self.state.aims[side].at(&self.state.world_from_pelvis, &commanded[side]))
    }

    pub(super) fn set_joints(&mut self, upper_rad: [f64; UPPER_JOINTS]) {
        self.state.upper_rad = upper_rad;
        self.state.aims = Sides::both(Aim::Joints);
    }

    pub(super) fn turn_waist(&mut self, column: usize, target_rad: f64) {
        self.state.upper_rad[column] = target_rad;
    }

    pub(super) fn set_fingers(&mut self, side: Side, fingers_rad: &[f64; HAND_JOINTS]) {
        self.state.upper_rad[columns::hand(side)].copy_from_slice(fingers_rad);
    }

    /// Where the commanded joints put the wrists, pelvis frame.
    pub(super) fn commanded_wrists(&self) -> Sides<Isometry3<f64>> {
        let configuration = self.configuration();
        self.body.wrists.map(|wrist| configuration.root_from_frame(wrist))
    }

    /// Joint targets for one step towards `aims`; an arm without a target keeps its joints.
    ///
    /// Inverse kinematics begins at the commanded, not at the measured joints: gravity's sag does not wind up.
    pub(super) fn follow(&mut self, aims: &Sides<Aim>) {
        let targets = self.in_pelvis(aims);
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

    /// Whether these joint targets take the centre of mass so far ahead, and farther than those in force.
    fn has_to_step(&self, upper_rad: &[f64; UPPER_JOINTS]) -> bool {
        let ahead_m = self.ahead_m(upper_rad);
        ahead_m > STEPS_AHEAD_M && ahead_m > self.ahead_m(&self.state.upper_rad)
    }

    /// How much farther ahead the whole robot's centre of mass is under these joint targets than with its arms at rest.
    fn ahead_m(&self, upper_rad: &[f64; UPPER_JOINTS]) -> f64 {
        ahead_m(&self.robot.model, upper_rad) - self.body.rest_ahead_m(&self.robot.model)
    }

    /// What a wrist may miss that has come to its target.
    pub fn tolerance(&self, side: Side) -> Tolerance {
        self.body.tolerance(side)
    }

    /// How near to `targets` (pelvis frame) the wrists would come to rest. An arm without a target keeps its joints.
    pub fn reach(&self, targets: &Sides<Option<Isometry3<f64>>>, keeps_waist: bool) -> Reach {
        let speeds_rad_s = self.body.speeds_rad_s(targets, keeps_waist);
        let tasks = self.body.tasks(targets, 1.0);
        // A command goes there step by step, and leaves the trunk more upright than the posture that is found at once.
        let mut twin = self.another();
        twin.state.restraint = Restraint { keeps_waist, stands_fast: false };
        let aims = targets.map(|target| target.map_or(Aim::Joints, Aim::Carried));
        (0..GOING_STEPS).for_each(|_| twin.follow(&aims));
        let mut asked = targets.by_side().filter(|(_, target)| target.is_some());
        let configuration = match asked.all(|(side, _)| self.body.turns_hand[side]) {
            true => self.body.posture(self.configuration(), &tasks, &speeds_rad_s),
            // What is found at once for an arm that cannot turn its hand gives up the place for the turn.
            false => twin.configuration(),
        };
        let mut errors = frame_errors(&configuration, &tasks);
        let errors = targets.each_ref().map(|target| target.as_ref().and_then(|_| errors.next()));
        let at_limit = tandem_ik::saturated(&configuration).into_iter();
        let at_limit = at_limit.filter(|joint| speeds_rad_s[*joint] > 0.0);
        let joints_at_limit = at_limit.map(|joint| self.body.model.joints()[joint].name.clone()).collect();
        Reach { errors, joints_at_limit, ahead_m: self.ahead_m(&twin.state.upper_rad) }
    }

    fn in_pelvis(&self, aims: &Sides<Aim>) -> Sides<Option<Isometry3<f64>>> {
        let asked = aims.map(|aim| aim.in_pelvis(&self.state.world_from_pelvis));
        let middle_m = match (asked.left, asked.right) {
            (Some(left), Some(right)) => 0.5 * (left.translation.vector + right.translation.vector),
            (None, _) | (_, None) => self.commanded_middle_m(),
        };
        let yielding = self.yielding(middle_m);
        asked.map(|asked| asked.map(|wrist| yielding * wrist))
    }

    fn configuration(&self) -> Configuration<'_> {
        configuration(&self.body, &self.state)
    }
}

fn configuration<'a>(body: &'a UpperBody, state: &MotionState) -> Configuration<'a> {
    let q: Vec<f64> = body.columns.iter().map(|column| state.upper_rad[*column]).collect();
    Configuration::new(&body.model, &q).expect("one finite target per joint")
}

impl Aim {
    /// The wrist's pose that is asked for, in the frame of a pelvis at `world_from_pelvis`; `None` for joints.
    pub fn in_pelvis(&self, world_from_pelvis: &Isometry3<f64>) -> Option<Isometry3<f64>> {
        match self {
            Aim::Joints => None,
            Aim::World(world_from_wrist) => Some(world_from_pelvis.inv_mul(world_from_wrist)),
            Aim::Carried(pelvis_from_wrist) => Some(*pelvis_from_wrist),
        }
    }

    /// An aim of the same kind at which a wrist at `pelvis_from_wrist` has arrived.
    pub fn at(&self, world_from_pelvis: &Isometry3<f64>, pelvis_from_wrist: &Isometry3<f64>) -> Aim {
        match self {
            Aim::Joints => Aim::Joints,
            Aim::World(_) => Aim::World(world_from_pelvis * pelvis_from_wrist),
            Aim::Carried(_) => Aim::Carried(*pelvis_from_wrist),
        }
    }

    /// The aim after `share` of the straight way from here to `goal`, in the goal's frame; the goal itself where the two are
    /// of different kinds.
    pub fn towards(&self, goal: &Aim, share: f64) -> Aim {
        match (self, goal) {
            (Aim::World(from), Aim::World(to)) => Aim::World(between(from, to, share)),
            (Aim::Carried(from), Aim::Carried(to)) => Aim::Carried(between(from, to, share)),
            (Aim::Joints | Aim::World(_) | Aim::Carried(_), goal) => *goal,
        }
    }
}

fn between(from: &Isometry3<f64>, to: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    from.try_lerp_slerp(to, share, 1e-9).unwrap_or(*to)
}
