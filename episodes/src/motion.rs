//! Joint targets of one robot, step by step: wrist poses through inverse kinematics, joint chunks as they are.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3};
use tandem_ik::{
    Capsule, Configuration, DampingTask, FrameId, FrameTask, IkError, JointCouplingTask, Limits, Model,
    Outcome, PostureTask, SelfCollision, SolveOptions, SolveReport, Solver, Task, Tolerance,
};
use tandem_sim::{
    BaseCommand, CONTROL_HZ, HAND_COLUMNS, HAND_JOINTS, RobotCommand, Side, UPPER, UPPER_JOINTS, joint_names,
};

const DT_S: f64 = 1.0 / CONTROL_HZ;
/// Unitree's limits are 22 to 37 rad/s; arms that work next to people and partners move slower.
const ARM_SPEED_RAD_S: f64 = 4.0;
const WAIST_SPEED_RAD_S: f64 = 1.0;
/// Part of the remaining error that one control step removes: smooth, and a lag of two steps.
const GAIN: f64 = 0.5;
const ORIENTATION_COST: f64 = 0.5;
/// Elbows stay near where they rest, without pulling a wrist off its target.
const POSTURE_COST: f64 = 0.02;
/// The trunk bends only when the arms do not suffice: bending moves the centre of mass.
const WAIST_COST: f64 = 0.15;
const DAMPING_COST: f64 = 2e-4;
pub const REACH_TOLERANCE: Tolerance = Tolerance { position_m: 0.005, orientation_rad: 0.05 };
const REACH_RESTARTS: usize = 8;

/// The upper body of the robot for inverse kinematics, shared by all robots of an episode.
pub struct UpperBody {
    model: Model,
    wrists: [FrameId; 2],
    /// Position in an action row of each joint of the model.
    columns: Vec<usize>,
    self_collision: SelfCollision,
    rest_rad: Vec<f64>,
}

impl UpperBody {
    /// Reads the robot's MJCF; `rest` is the command that it stands under.
    pub fn new(robot_mjcf: &str, rest: &RobotCommand) -> Result<UpperBody, IkError> {
        let names = joint_names();
        let model = upper_body(&Model::from_mjcf(robot_mjcf)?)?;
        let column_of = |name: &str| (0..UPPER_JOINTS).find(|column| names[UPPER[*column]] == name);
        let columns: Vec<usize> = model.joints().iter().filter_map(|joint| column_of(&joint.name)).collect();
        let rest_rad = columns.iter().map(|column| rest.upper_rad[*column].into()).collect();
        Ok(UpperBody {
            wrists: [model.frame("left_wrist")?, model.frame("right_wrist")?],
            self_collision: self_collision(&model)?,
            model,
            columns,
            rest_rad,
        })
    }

    fn tasks(&self, targets: &[Isometry3<f64>; 2], gain: f64) -> Vec<Task> {
        let mut tasks: Vec<Task> = Vec::with_capacity(7);
        for side in Side::BOTH {
            let wrist = FrameTask::new(self.wrists[side.index()], targets[side.index()]);
            tasks.push(Task::Frame(FrameTask { orientation_cost: ORIENTATION_COST, gain, ..wrist }));
        }
        tasks.push(Task::Posture(PostureTask {
            target: self.rest_rad.clone(),
            cost: POSTURE_COST,
            gain: 0.1,
        }));
        for (joint, model) in self.model.joints().iter().enumerate() {
            if model.name.starts_with("waist") {
                let upright = JointCouplingTask {
                    ratios: vec![(joint, 1.0)],
                    offset: 0.0,
                    cost: WAIST_COST,
                    gain: 0.1,
                };
                tasks.push(Task::JointCoupling(upright));
            }
        }
        tasks.push(Task::Damping(DampingTask { cost: DAMPING_COST }));
        tasks
    }

    fn solver(&self) -> Solver {
        let mut solver = Solver::new(&self.model, DT_S);
        let speed = |name: &str| if name.starts_with("waist") { WAIST_SPEED_RAD_S } else { ARM_SPEED_RAD_S };
        let velocity = self.model.joints().iter().map(|joint| speed(&joint.name)).collect();
        solver.limits = Limits { velocity, ..Limits::of(&self.model) };
        solver.self_collision = Some(self.self_collision.clone());
        solver
    }
}

/// The robot with arms and waist free; legs and hands are locked straight.
pub fn upper_body(whole: &Model) -> Result<Model, IkError> {
    let names = joint_names();
    let is_hand = |column: usize| (HAND_COLUMNS.left..HAND_COLUMNS.right + HAND_JOINTS).contains(&column);
    let columns = (0..UPPER_JOINTS).filter(|column| !is_hand(*column));
    let free: Vec<&str> = columns.map(|column| names[UPPER[column]].as_str()).collect();
    whole.reduced(&free, &vec![0.0; whole.nv()])
}

/// Trunk, head, forearms and hands as capsules, a little inside the collision shapes of the robot's file.
fn self_collision(model: &Model) -> Result<SelfCollision, IkError> {
    let capsule = |frame: &str, a: [f64; 3], b: [f64; 3], radius_m: f64| -> Result<Capsule, IkError> {
        Ok(Capsule { frame: model.frame(frame)?, ends: [Point3::from(a), Point3::from(b)], radius_m })
    };
    let mut capsules = vec![
        capsule("torso_link", [0.0, 0.0, 0.08], [0.0, 0.0, 0.25], 0.10)?,
        capsule("torso_link", [0.0, 0.0, 0.43], [0.0, 0.0, 0.43], 0.10)?,
    ];
    for side in Side::BOTH {
        let link = |part: &str| format!("{}_{part}_link", side.name());
        capsules.push(capsule(&link("elbow"), [0.0; 3], [0.10, 0.0, -0.01], 0.035)?);
        capsules.push(capsule(&link("wrist_yaw"), [0.0; 3], [0.15, 0.0, 0.0], 0.045)?);
    }
    let pairs = vec![[0, 2], [0, 3], [1, 3], [0, 4], [0, 5], [1, 5], [3, 5], [2, 5], [3, 4], [2, 4]];
    Ok(SelfCollision { capsules, pairs, margin_m: 0.005, range_m: 0.08, gain: 0.3 })
}

/// What moves one robot.
pub struct Motion {
    body: Arc<UpperBody>,
    solver: Solver,
    state: MotionState,
}

/// What one robot was last told: all of a motion that outlasts a control step.
#[derive(Clone, Debug)]
pub struct MotionState {
    /// Joint targets of the present control step, action order.
    upper_rad: [f64; UPPER_JOINTS],
    base: BaseCommand,
    /// Where the wrists are to be, pelvis frame: left, right.
    targets: [Isometry3<f64>; 2],
    /// What the solver remembers of steps that did not help; see [`Solver::caution`].
    caution: f64,
    /// Joints follow `targets`; otherwise the last joint chunk's row holds.
    follows_wrists: bool,
}

/// What one robot does during a command; wrists and fingers arrive with its last step.
#[derive(Clone, Debug)]
pub struct Plan {
    pub wrists: [Option<Isometry3<f64>>; 2],
    pub fingers_rad: [Option<[f64; HAND_JOINTS]>; 2],
    /// One row of joint targets and base command per step, in place of wrists and fingers.
    pub rows: Option<Vec<([f64; UPPER_JOINTS], BaseCommand)>>,
    pub base: BaseCommand,
}

impl Motion {
    /// A robot that stands under `rest`.
    pub fn new(body: &Arc<UpperBody>, rest: &RobotCommand) -> Motion {
        let state = MotionState {
            upper_rad: rest.upper_rad.map(f64::from),
            base: rest.base,
            targets: [Isometry3::identity(); 2],
            caution: 1.0,
            follows_wrists: true,
        };
        let mut motion = Motion { solver: body.solver(), body: body.clone(), state };
        motion.state.targets = motion.commanded_wrists();
        motion
    }

    pub fn state(&self) -> &MotionState {
        &self.state
    }

    pub fn set_state(&mut self, state: MotionState) {
        self.state = state;
    }

    pub fn base(&self) -> BaseCommand {
        self.state.base
    }

    /// Wrist targets in force, pelvis frame.
    pub fn targets(&self) -> &[Isometry3<f64>; 2] {
        &self.state.targets
    }

    /// A plan under which nothing new is asked for and the base stands.
    pub fn hold(&self) -> Plan {
        let base = BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, ..self.state.base };
        Plan { wrists: [None; 2], fingers_rad: [None; 2], rows: None, base }
    }

    /// Takes up a plan that runs for `steps` control steps; [`Run::command`] gives each of them.
    pub fn begin(&mut self, plan: Plan, steps: u32) -> Run {
        let from_wrists = self.commanded_wrists();
        let from_rad = self.state.upper_rad;
        for side in Side::BOTH {
            if let Some(target) = plan.wrists[side.index()] {
                if !self.state.follows_wrists {
                    // The other wrist stays where the last joint chunk left it.
                    self.state.targets = from_wrists;
                }
                self.state.targets[side.index()] = target;
                self.state.follows_wrists = true;
            }
        }
        Run { plan, steps, done: 0, from_wrists, from_rad }
    }

    /// Where the commanded joints put the wrists, pelvis frame.
    fn commanded_wrists(&self) -> [Isometry3<f64>; 2] {
        let configuration = self.configuration();
        self.body.wrists.map(|wrist| configuration.root_from_frame(wrist))
    }

    fn configuration(&self) -> Configuration<'_> {
        let q: Vec<f64> = self.body.columns.iter().map(|column| self.state.upper_rad[*column]).collect();
        Configuration::new(&self.body.model, &q).expect("one finite target per joint")
    }

    /// One step of inverse kinematics from the commanded, not the measured joints: gravity's sag does not wind up.
    fn follow(&mut self, targets: &[Isometry3<f64>; 2]) {
        let body = self.body.clone();
        let tasks = body.tasks(targets, GAIN);
        let q: Vec<f64> = body.columns.iter().map(|column| self.state.upper_rad[*column]).collect();
        let mut configuration = Configuration::new(&body.model, &q).expect("one finite target per joint");
        self.solver.caution = self.state.caution;
        if let Outcome::Infeasible { .. } = self.solver.track(&mut configuration, &tasks, &[]) {
            // Shapes that already overlap can contradict each other; the joints must still get out.
            let barrier = self.solver.self_collision.take();
            self.solver.track(&mut configuration, &tasks, &[]);
            self.solver.self_collision = barrier;
        }
        self.state.caution = self.solver.caution;
        for (column, q) in body.columns.iter().zip(configuration.q()) {
            self.state.upper_rad[*column] = *q;
        }
    }

    /// Whether the wrists would get to `targets` from here.
    pub fn reach(&self, targets: &[Isometry3<f64>; 2]) -> (SolveReport, Vec<String>) {
        let mut solver = self.body.solver();
        solver.tolerance = REACH_TOLERANCE;
        let mut configuration = self.configuration();
        let options = SolveOptions { restarts: REACH_RESTARTS, ..SolveOptions::default() };
        let report = solver.solve(&mut configuration, &self.body.tasks(targets, 1.0), &options);
        let at_limit = tandem_ik::saturated(&configuration);
        let names = at_limit.iter().map(|joint| self.body.model.joints()[*joint].name.clone()).collect();
        (report, names)
    }
}

/// A plan under way.
pub struct Run {
    plan: Plan,
    steps: u32,
    done: u32,
    from_wrists: [Isometry3<f64>; 2],
    from_rad: [f64; UPPER_JOINTS],
}

impl Run {
    /// The next control step's command. Wrist targets and fingers move in a straight line over the command's steps.
    pub fn command(&mut self, motion: &mut Motion) -> RobotCommand {
        self.done += 1;
        let part = f64::from(self.done) / f64::from(self.steps);
        motion.state.base = self.plan.base;
        if let Some(rows) = &self.plan.rows {
            let (upper_rad, base) = rows[self.done as usize - 1];
            motion.state.upper_rad = upper_rad;
            motion.state.base = base;
            motion.state.follows_wrists = false;
            motion.state.targets = motion.commanded_wrists();
        }
        for side in Side::BOTH {
            if let Some(goal_rad) = &self.plan.fingers_rad[side.index()] {
                let first = HAND_COLUMNS[side];
                for (finger, goal_rad) in goal_rad.iter().enumerate() {
                    let from_rad = self.from_rad[first + finger];
                    motion.state.upper_rad[first + finger] = from_rad + (goal_rad - from_rad) * part;
                }
            }
        }
        if motion.state.follows_wrists {
            let mut targets = motion.state.targets;
            for side in Side::BOTH {
                if let Some(goal) = &self.plan.wrists[side.index()] {
                    targets[side.index()] = between(&self.from_wrists[side.index()], goal, part);
                }
            }
            motion.follow(&targets);
        }
        RobotCommand {
            upper_rad: motion.state.upper_rad.map(|target| target as f32),
            base: motion.state.base,
        }
    }
}

fn between(from: &Isometry3<f64>, to: &Isometry3<f64>, part: f64) -> Isometry3<f64> {
    from.try_lerp_slerp(to, part, 1e-9).unwrap_or(*to)
}
