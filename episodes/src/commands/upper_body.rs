//! The robot above its hips for inverse kinematics: free joints, collision shapes, and secondary tasks
//! beside the wrists' targets.

use nalgebra::{Isometry3, Point3};
use tandem_ik::{
    Capsule, Configuration, DampingTask, FrameId, FrameTask, IkError, JointCouplingTask, Model, PostureTask,
    SelfCollision, SolveOptions, Solver, Task, Tolerance,
};
use tandem_sim::{
    CONTROL_HZ, JOINTS, Pose, RobotCommand, RobotModel, RobotSource, Side, Sides, UPPER, UPPER_JOINTS,
    joint_names,
};

use super::columns;

/// Speed limits. Unitree's are 22 to 37 rad/s; arms near people and partners move slower.
const ARM_SPEED_RAD_S: f64 = 4.0;
const WAIST_SPEED_RAD_S: f64 = 1.0;
const ORIENTATION_COST: f64 = 0.5;
/// Orientation cost for an arm that cannot set its hand's orientation freely. At this cost, the
/// orientation error displaces the wrist by millimetres only.
const SHORT_ARM_ORIENTATION_COST: f64 = 0.02;
/// Number of coordinates of a pose, and of joints that an arm needs to reach any pose.
const POSE_NUMBERS: usize = 6;
/// Cost that keeps elbows near rest without pulling a wrist off its target.
const POSTURE_COST: f64 = 0.02;
/// Cost at which the trunk bends only when the arms do not suffice: bending moves the centre of mass.
const WAIST_COST: f64 = 0.15;
const DAMPING_COST: f64 = 2e-4;
const REACH_RESTARTS: usize = 8;
/// Forward displacement of the centre of mass by the arms at which a robot steps, measured for one arm
/// and for both at several heights.
pub const STEPS_AHEAD_M: f64 = 0.05;
const REACH_TOLERANCE: Tolerance = Tolerance { position_m: 0.005, orientation_rad: 0.05 };

/// Model of the upper body, shared by all robots of an episode.
pub struct UpperBody {
    pub model: Model,
    pub wrists: Sides<FrameId>,
    /// Column in an action row of each joint in the model.
    pub columns: Vec<usize>,
    /// True for an arm with enough joints to set its hand's orientation freely.
    pub turns_hand: Sides<bool>,
    self_collision: SelfCollision,
    rest_rad: Vec<f64>,
    /// Rest angles of all joints above the hips, in action order.
    rest_upper_rad: [f64; UPPER_JOINTS],
}

impl UpperBody {
    /// Builds the model of a robot; `rest` is the command under which it stands.
    pub fn new(robot: &RobotSource, rest: &RobotCommand) -> Result<UpperBody, IkError> {
        let names = joint_names();
        let model = upper_body(&Model::from_parsed_mjcf(&robot.document.model)?)?;
        let column_of = |name: &str| (0..UPPER_JOINTS).find(|column| names[UPPER[*column]] == name);
        let columns: Vec<usize> = model.joints().iter().filter_map(|joint| column_of(&joint.name)).collect();
        let joints = |side: Side| columns.iter().filter(|column| columns::arm(side).contains(column)).count();
        let rest_rad = columns.iter().map(|column| rest.upper_rad[*column].into()).collect();
        Ok(UpperBody {
            wrists: Sides { left: model.frame("left_wrist")?, right: model.frame("right_wrist")? },
            turns_hand: Sides::from_fn(|side| joints(side) >= POSE_NUMBERS),
            self_collision: self_collision(&model, &robot.model)?,
            model,
            columns,
            rest_rad,
            rest_upper_rad: rest.upper_rad.map(f64::from),
        })
    }

    /// Returns the forward distance of the centre of mass from the pelvis in a robot at rest.
    pub fn rest_ahead_m(&self, robot: &RobotModel) -> f64 {
        ahead_m(robot, &self.rest_upper_rad)
    }

    /// Returns the tolerance within which a wrist has reached its target. For an arm of few joints, any
    /// orientation is accepted.
    pub fn tolerance(&self, side: Side) -> Tolerance {
        match self.turns_hand[side] {
            true => REACH_TOLERANCE,
            false => Tolerance { orientation_rad: f64::INFINITY, ..REACH_TOLERANCE },
        }
    }

    /// Returns the tasks of one step: the wrists with `targets`, and secondary tasks that minimise other
    /// motion. The step removes the fraction `gain` of the wrists' error.
    pub fn tasks(&self, targets: &Sides<Option<Isometry3<f64>>>, gain: f64) -> Vec<Task> {
        let mut tasks: Vec<Task> = Vec::with_capacity(7);
        for (side, target) in targets.by_side() {
            let Some(target) = target else { continue };
            let wrist = FrameTask::new(self.wrists[side], target);
            let orientation_cost =
                if self.turns_hand[side] { ORIENTATION_COST } else { SHORT_ARM_ORIENTATION_COST };
            tasks.push(Task::Frame(FrameTask { orientation_cost, gain, ..wrist }));
        }
        tasks.push(Task::Posture(PostureTask {
            target: self.rest_rad.clone(),
            cost: POSTURE_COST,
            gain: 0.1,
        }));
        for (joint, model) in self.model.joints().iter().enumerate() {
            if is_waist(&model.name) {
                let ratios = vec![(joint, 1.0)];
                let upright = JointCouplingTask { ratios, offset: 0.0, cost: WAIST_COST, gain: 0.1 };
                tasks.push(Task::JointCoupling(upright));
            }
        }
        tasks.push(Task::Damping(DampingTask { cost: DAMPING_COST }));
        tasks
    }

    /// Returns a solver with range limits and self-collision. Its speed limits depend on the targets.
    pub fn solver(&self) -> Solver {
        let mut solver = Solver::new(&self.model, 1.0 / CONTROL_HZ);
        solver.self_collision = Some(self.self_collision.clone());
        solver
    }

    /// Solves for the posture that fits the tasks best, starting from another one, with these speed limits.
    pub fn posture<'a>(
        &self,
        from: Configuration<'a>,
        tasks: &[Task],
        speeds_rad_s: &[f64],
    ) -> Configuration<'a> {
        let mut solver = self.solver();
        solver.tolerance = REACH_TOLERANCE;
        solver.limits.velocity = speeds_rad_s.to_vec();
        let mut posture = from;
        let options = SolveOptions { restarts: REACH_RESTARTS, ..SolveOptions::default() };
        solver.solve(&mut posture, tasks, &options);
        posture
    }

    /// Returns the speed limit of each joint in the model. It is 0 for an arm without a target, and for a
    /// kept waist.
    pub fn speeds_rad_s(&self, targets: &Sides<Option<Isometry3<f64>>>, keeps_waist: bool) -> Vec<f64> {
        let speed_rad_s = |column: &usize| {
            let side = Side::BOTH.into_iter().find(|side| columns::arm(*side).contains(column));
            match side.map(|side| targets[side]) {
                None if keeps_waist => 0.0,
                None => WAIST_SPEED_RAD_S,
                Some(None) => 0.0,
                Some(Some(_)) => ARM_SPEED_RAD_S,
            }
        };
        self.columns.iter().map(speed_rad_s).collect()
    }
}

/// Returns the forward distance of the centre of mass from the pelvis, with the joints above the hips at
/// these angles and the legs straight.
pub fn ahead_m(model: &RobotModel, upper_rad: &[f64; UPPER_JOINTS]) -> f64 {
    let mut q_rad = [0.0; JOINTS];
    for (column, angle_rad) in upper_rad.iter().enumerate() {
        q_rad[UPPER[column]] = *angle_rad as f32;
    }
    let poses = model.forward_kinematics(Pose::IDENTITY, &q_rad);
    let (mut mass_kg, mut moment_kg_m) = (0.0, 0.0);
    for (link, pose) in model.links.iter().zip(&poses) {
        mass_kg += f64::from(link.mass.mass());
        moment_kg_m += f64::from(link.mass.mass() * (*pose * link.mass.local_com).x);
    }
    moment_kg_m / mass_kg
}

fn is_waist(joint: &str) -> bool {
    joint.starts_with("waist")
}

/// Returns the robot's model with free arms and waist; legs and hands are locked straight.
pub fn upper_body(whole: &Model) -> Result<Model, IkError> {
    let names = joint_names();
    let columns = (0..UPPER_JOINTS).filter(|column| !columns::is_hand(*column));
    let has = |name: &&str| whole.joints().iter().any(|joint| joint.name == *name);
    let free: Vec<&str> = columns.map(|column| names[UPPER[column]].as_str()).filter(has).collect();
    whole.reduced(&free, &vec![0.0; whole.nv()])
}

/// Pairs of capsules that must not collide: trunk, head, then forearm and hand of the left and of the
/// right arm.
const PAIRS: [[usize; 2]; 10] =
    [[0, 2], [0, 3], [1, 3], [0, 4], [0, 5], [1, 5], [3, 5], [2, 5], [3, 4], [2, 4]];

fn self_collision(model: &Model, robot: &RobotModel) -> Result<SelfCollision, IkError> {
    let capsules = g1_capsules(model).or_else(|_| capsules(model, robot))?;
    Ok(SelfCollision { capsules, pairs: PAIRS.into(), margin_m: 0.005, range_m: 0.08, gain: 0.3 })
}

fn capsule(model: &Model, frame: &str, ends_m: [[f64; 3]; 2], radius_m: f64) -> Result<Capsule, IkError> {
    Ok(Capsule { frame: model.frame(frame)?, ends: ends_m.map(Point3::from), radius_m })
}

/// Returns the capsules of a G1, slightly smaller than the collision shapes of its file.
fn g1_capsules(model: &Model) -> Result<Vec<Capsule>, IkError> {
    let mut capsules = vec![
        capsule(model, "torso_link", [[0.0, 0.0, 0.08], [0.0, 0.0, 0.25]], 0.10)?,
        capsule(model, "torso_link", [[0.0, 0.0, 0.43]; 2], 0.10)?,
    ];
    for side in Side::BOTH {
        let link = |part: &str| format!("{}_{part}_link", side.name());
        capsules.push(capsule(model, &link("elbow"), [[0.0; 3], [0.10, 0.0, -0.01]], 0.035)?);
        capsules.push(capsule(model, &link("wrist_yaw"), [[0.0; 3], [0.15, 0.0, 0.0]], 0.045)?);
    }
    Ok(capsules)
}

/// Returns the capsules of a robot whose file has other names for its links, from the places of its joints.
/// They are a trunk below the shoulders and as wide, a head around the camera, and a forearm and a hand of
/// each arm. The forearm extends to the link of the wrist, and the hand from there to the palm. Their
/// thickness is that of a G1, scaled to this robot.
fn capsules(model: &Model, robot: &RobotModel) -> Result<Vec<Capsule>, IkError> {
    let poses = robot.forward_kinematics(Pose::IDENTITY, &[0.0; JOINTS]);
    let (name, size) = (|link: usize| &robot.links[link].name, f64::from(robot.scale.length_m(1.0)));
    let numbers = |point_m: tandem_sim::Vector| point_m.to_array().map(f64::from);
    let shoulder = &robot.links[robot.shoulder(Side::Left)];
    let [x, y, z] = numbers(shoulder.parent_from_link.translation);
    let trunk = name(shoulder.parent.unwrap_or_default());
    let [ahead, across, up] = numbers(robot.egocentric.body_from_camera.translation);
    let head = [ahead - 0.1 * size, across, up];
    let mut capsules = vec![
        capsule(model, trunk, [[x, 0.0, 0.3 * z], [x, 0.0, z]], 0.95 * y.abs())?,
        capsule(model, name(robot.egocentric_link), [head; 2], 0.1 * size)?,
    ];
    for side in Side::BOTH {
        let hand = &robot.hands[side];
        let before = robot.links[hand.wrist].parent.unwrap_or_default();
        let end_m = poses[before].inverse() * poses[hand.wrist].translation;
        capsules.push(capsule(model, name(before), [[0.0; 3], numbers(end_m)], 0.035 * size)?);
        let palm_m = numbers(hand.palm_in_wrist_m);
        capsules.push(capsule(model, name(hand.wrist), [[0.0; 3], palm_m], 0.045 * size)?);
    }
    Ok(capsules)
}
