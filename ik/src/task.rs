//! What is asked of the joints, as weighted least squares in the joint displacement dq.
//!
//! Each task asks for  J dq = alpha e  at a cost, and adds to the quadratic program
//!   1/2 |W (J dq - alpha e)|^2 + 1/2 mu |dq|^2,   mu = lambda |alpha W e|^2,
//! so that  H += (WJ)'(WJ) + mu I,  c -= alpha (WJ)'(We).
//! J: k x nv; e: k; W: diagonal. lambda is Levenberg-Marquardt damping, which fades as the error does.
//! Source: Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, 2011.

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};

use crate::program::Sink;
use crate::spatial::Log6;
use crate::{Configuration, FrameId, Model};

/// One thing to achieve; see the variants.
#[derive(Clone, Debug)]
pub enum Task {
    /// A frame at a pose in the root's frame.
    Frame(FrameTask),
    /// A frame at a pose in another frame.
    RelativeFrame(RelativeFrameTask),
    /// The centre of mass at a point in the root's frame.
    CenterOfMass(CenterOfMassTask),
    /// All joints near given coordinates.
    Posture(PostureTask),
    /// Slow joints.
    Damping(DampingTask),
    /// Joints that move at given speeds.
    JointVelocity(JointVelocityTask),
    /// Joints that keep their speed.
    LowAcceleration(LowAccelerationTask),
    /// Joints whose coordinates keep a linear relation.
    JointCoupling(JointCouplingTask),
}

/// Puts a frame at a pose. Error: e = log(frame^-1 target), 6, [m; rad], in the frame itself;
/// J = J_l^-1(e) J_body, with J_l the left Jacobian of SE(3).
#[derive(Clone, Debug)]
pub struct FrameTask {
    /// The frame.
    pub frame: FrameId,
    /// Where it should be, in the root's frame.
    pub target: Isometry3<f64>,
    /// Cost per metre.
    pub position_cost: f64,
    /// Cost per radian.
    pub orientation_cost: f64,
    /// alpha in 0..=1: the part of the error to remove in one step.
    pub gain: f64,
    /// lambda, dimensionless.
    pub lm_damping: f64,
}

impl FrameTask {
    /// Cost 1 per metre and per radian, gain 1, no Levenberg-Marquardt damping.
    pub fn new(frame: FrameId, target: Isometry3<f64>) -> FrameTask {
        FrameTask { frame, target, position_cost: 1.0, orientation_cost: 1.0, gain: 1.0, lm_damping: 0.0 }
    }

    /// What is missing; a component without cost is not asked for and counts as 0.
    pub fn error(&self, configuration: &Configuration) -> FrameError {
        FrameError::of(&self.missing(configuration), [self.position_cost, self.orientation_cost])
    }
}

/// What a frame is away from its target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameError {
    /// Distance of the origins, m.
    pub position_m: f64,
    /// Angle between the orientations, rad.
    pub orientation_rad: f64,
}

impl FrameError {
    fn of(missing: &Isometry3<f64>, [position_cost, orientation_cost]: [f64; 2]) -> FrameError {
        FrameError {
            position_m: if position_cost > 0.0 { missing.translation.vector.norm() } else { 0.0 },
            orientation_rad: if orientation_cost > 0.0 { missing.rotation.angle() } else { 0.0 },
        }
    }

    /// Squared, metres and radians alike.
    pub(crate) fn squared(&self) -> f64 {
        self.position_m.powi(2) + self.orientation_rad.powi(2)
    }
}

/// Puts a frame at a pose in another frame that moves too.
#[derive(Clone, Debug)]
pub struct RelativeFrameTask {
    /// The frame to move.
    pub frame: FrameId,
    /// The frame that the target is given in.
    pub reference: FrameId,
    /// Where `frame` should be, in `reference`.
    pub target: Isometry3<f64>,
    /// Cost per metre.
    pub position_cost: f64,
    /// Cost per radian.
    pub orientation_cost: f64,
    /// alpha in 0..=1.
    pub gain: f64,
}

/// Puts the centre of mass at a point. e = target - centre, 3, m.
#[derive(Clone, Debug)]
pub struct CenterOfMassTask {
    /// In the root's frame, m.
    pub target: Vector3<f64>,
    /// Cost per metre, along the root's axes; 0 leaves an axis free.
    pub cost: Vector3<f64>,
    /// alpha in 0..=1.
    pub gain: f64,
}

/// Keeps all joints near coordinates. J = 1, e = target - q, nv.
#[derive(Clone, Debug)]
pub struct PostureTask {
    /// Model order, rad or m.
    pub target: Vec<f64>,
    /// Cost per rad or m.
    pub cost: f64,
    /// alpha in 0..=1.
    pub gain: f64,
}

/// Costs joint speed: J = 1 / dt, e = 0, nv, rad/s. Pink's damping task leaves dt out; its cost is this one's over dt.
#[derive(Clone, Debug)]
pub struct DampingTask {
    /// Cost per rad/s or m/s.
    pub cost: f64,
}

/// Asks for joint speeds. J = 1 / dt, e = target, nv, rad/s.
#[derive(Clone, Debug)]
pub struct JointVelocityTask {
    /// Model order, rad/s or m/s.
    pub target: Vec<f64>,
    /// Cost per rad/s or m/s.
    pub cost: f64,
}

/// Costs changes of joint speed since the last step. J = 1 / dt, e = last velocity, nv, rad/s.
#[derive(Clone, Debug)]
pub struct LowAccelerationTask {
    /// Cost per rad/s or m/s.
    pub cost: f64,
}

/// Keeps  sum_i ratio_i q_i = offset, with each joint named once.  J = ratios, e = offset - ratios' q, 1.
#[derive(Clone, Debug)]
pub struct JointCouplingTask {
    /// Joint and its ratio.
    pub ratios: Vec<(usize, f64)>,
    /// rad or m.
    pub offset: f64,
    /// Cost per rad or m.
    pub cost: f64,
    /// alpha in 0..=1.
    pub gain: f64,
}

/// What tasks need to know beside the configuration.
pub(crate) struct StepContext<'a> {
    pub dt_s: f64,
    pub last_velocity: &'a [f64],
    /// Errors of frames are cut to this.
    pub error_clamp: Option<FrameError>,
}

/// What one step of a whole solution takes on: far targets do not upset near joints.
pub(crate) const ERROR_CLAMP: FrameError = FrameError { position_m: 0.3, orientation_rad: 0.9 };

/// Buffers of one evaluation, so that nothing allocates.
#[derive(Default)]
pub(crate) struct TaskScratch {
    columns: Vec<(usize, Vector6<f64>)>,
    entries: Vec<(usize, f64)>,
    centre: Vec<Vector3<f64>>,
}

impl TaskScratch {
    pub(crate) fn new(nv: usize) -> TaskScratch {
        TaskScratch {
            columns: Vec::with_capacity(2 * nv),
            entries: Vec::with_capacity(2 * nv),
            centre: vec![Vector3::zeros(); nv],
        }
    }
}

impl Task {
    /// What is missing to a frame's pose or to the centre of mass; `None` for tasks that only shape the way there.
    pub fn error(&self, configuration: &Configuration) -> Option<FrameError> {
        match self {
            Task::Frame(task) => Some(task.error(configuration)),
            Task::RelativeFrame(task) => Some(task.error(configuration)),
            Task::CenterOfMass(task) => Some(task.error(configuration)),
            Task::Posture(_)
            | Task::Damping(_)
            | Task::JointVelocity(_)
            | Task::LowAcceleration(_)
            | Task::JointCoupling(_) => None,
        }
    }

    /// alpha/2 |W e|^2; 0 for tasks on velocities, which a line search leaves alone.
    pub(crate) fn objective(&self, configuration: &Configuration) -> f64 {
        match self {
            Task::Frame(task) => {
                let weights = [task.position_cost, task.orientation_cost];
                0.5 * task.gain * weighted_square(&Log6::of(&task.missing(configuration)).twist, weights)
            }
            Task::RelativeFrame(task) => {
                let weights = [task.position_cost, task.orientation_cost];
                0.5 * task.gain * weighted_square(&Log6::of(&task.missing(configuration)).twist, weights)
            }
            Task::CenterOfMass(task) => {
                let missing = task.target - configuration.center_of_mass();
                0.5 * task.gain * missing.component_mul(&task.cost).norm_squared()
            }
            Task::Posture(task) => {
                let missing =
                    task.target.iter().zip(configuration.q()).map(|(target, q)| (target - q).powi(2));
                0.5 * task.gain * task.cost * task.cost * missing.sum::<f64>()
            }
            Task::JointCoupling(task) => 0.5 * task.gain * (task.cost * task.missing(configuration)).powi(2),
            Task::Damping(_) | Task::JointVelocity(_) | Task::LowAcceleration(_) => 0.0,
        }
    }

    /// For messages: what the task is about.
    pub(crate) fn describe(&self, model: &Model) -> String {
        match self {
            Task::Frame(task) => format!("pose of {}", model.frame_name(task.frame)),
            Task::RelativeFrame(task) => {
                format!("pose of {} in {}", model.frame_name(task.frame), model.frame_name(task.reference))
            }
            Task::CenterOfMass(_) => "centre of mass".into(),
            Task::Posture(_) => "posture".into(),
            Task::Damping(_) => "damping".into(),
            Task::JointVelocity(_) => "joint velocities".into(),
            Task::LowAcceleration(_) => "low acceleration".into(),
            Task::JointCoupling(task) => {
                let joints: Vec<&str> =
                    task.ratios.iter().map(|(joint, _)| model.joints()[*joint].name.as_str()).collect();
                format!("coupling of {}", joints.join(", "))
            }
        }
    }

    pub(crate) fn write(
        &self,
        configuration: &Configuration,
        context: &StepContext,
        scratch: &mut TaskScratch,
        sink: &mut impl Sink,
    ) {
        match self {
            Task::Frame(task) => task.write(configuration, context, scratch, sink),
            Task::RelativeFrame(task) => task.write(configuration, context, scratch, sink),
            Task::CenterOfMass(task) => task.write(configuration, scratch, sink),
            Task::Posture(task) => {
                let q = configuration.q();
                sink.diagonal(task.cost, |joint| task.gain * (task.target[joint] - q[joint]));
            }
            Task::Damping(task) => sink.diagonal(task.cost / context.dt_s, |_| 0.0),
            Task::JointVelocity(task) => {
                sink.diagonal(task.cost / context.dt_s, |joint| task.target[joint] * context.dt_s);
            }
            Task::LowAcceleration(task) => {
                sink.diagonal(task.cost / context.dt_s, |joint| context.last_velocity[joint] * context.dt_s);
            }
            Task::JointCoupling(task) => {
                scratch.entries.clear();
                scratch.entries.extend(task.ratios.iter().map(|(joint, ratio)| (*joint, task.cost * ratio)));
                sink.row(&scratch.entries, task.cost * task.gain * task.missing(configuration));
            }
        }
    }
}

impl FrameTask {
    fn missing(&self, configuration: &Configuration) -> Isometry3<f64> {
        configuration.root_from_frame(self.frame).inverse() * self.target
    }

    fn write(
        &self,
        configuration: &Configuration,
        context: &StepContext,
        scratch: &mut TaskScratch,
        sink: &mut impl Sink,
    ) {
        let root_from_frame = configuration.root_from_frame(self.frame);
        let missing = Log6::of(&clamped(&self.missing(configuration), context.error_clamp));
        scratch.columns.clear();
        for &joint in configuration.model().support(self.frame) {
            let (linear, angular) = configuration.body_jacobian_column(&root_from_frame, joint);
            scratch.columns.push((joint, missing.transform(&linear, &angular)));
        }
        let weights = [self.position_cost, self.orientation_cost];
        write_pose_rows(scratch, &missing.twist, weights, self.gain, sink);
        sink.damp(self.lm_damping * self.gain * self.gain * weighted_square(&missing.twist, weights));
    }
}

impl RelativeFrameTask {
    fn missing(&self, configuration: &Configuration) -> Isometry3<f64> {
        let frame_from_root = configuration.root_from_frame(self.frame).inverse();
        frame_from_root * configuration.root_from_frame(self.reference) * self.target
    }

    fn error(&self, configuration: &Configuration) -> FrameError {
        FrameError::of(&self.missing(configuration), [self.position_cost, self.orientation_cost])
    }

    fn write(
        &self,
        configuration: &Configuration,
        context: &StepContext,
        scratch: &mut TaskScratch,
        sink: &mut impl Sink,
    ) {
        let root_from_frame = configuration.root_from_frame(self.frame);
        let missing = Log6::of(&clamped(&self.missing(configuration), context.error_clamp));
        scratch.columns.clear();
        for &joint in configuration.model().support(self.frame) {
            let (linear, angular) = configuration.body_jacobian_column(&root_from_frame, joint);
            scratch.columns.push((joint, missing.transform(&linear, &angular)));
        }
        // The reference carries the goal along: the frame sees it move the other way.
        for &joint in configuration.model().support(self.reference) {
            let (linear, angular) =
                configuration.velocity_of_point(&root_from_frame.translation.vector, joint);
            let frame_from_root = root_from_frame.rotation.inverse();
            let carried = missing.transform(&(frame_from_root * linear), &(frame_from_root * angular));
            match scratch.columns.iter_mut().find(|(known, _)| *known == joint) {
                Some((_, column)) => *column -= carried,
                None => scratch.columns.push((joint, -carried)),
            }
        }
        write_pose_rows(
            scratch,
            &missing.twist,
            [self.position_cost, self.orientation_cost],
            self.gain,
            sink,
        );
    }
}

impl JointCouplingTask {
    fn missing(&self, configuration: &Configuration) -> f64 {
        self.offset - self.ratios.iter().map(|(joint, ratio)| ratio * configuration.q()[*joint]).sum::<f64>()
    }
}

impl CenterOfMassTask {
    fn error(&self, configuration: &Configuration) -> FrameError {
        let asked = self.cost.map(|cost| if cost > 0.0 { 1.0 } else { 0.0 });
        let missing = (self.target - configuration.center_of_mass()).component_mul(&asked);
        FrameError { position_m: missing.norm(), orientation_rad: 0.0 }
    }

    fn write(&self, configuration: &Configuration, scratch: &mut TaskScratch, sink: &mut impl Sink) {
        configuration.center_of_mass_jacobian(&mut scratch.centre);
        let missing = self.target - configuration.center_of_mass();
        for axis in 0..3 {
            let cost = self.cost[axis];
            scratch.entries.clear();
            scratch.entries.extend(
                scratch.centre.iter().enumerate().map(|(joint, column)| (joint, cost * column[axis])),
            );
            sink.row(&scratch.entries, cost * self.gain * missing[axis]);
        }
    }
}

/// |W e|^2 of a pose's error.
fn weighted_square(error: &Vector6<f64>, [position, orientation]: [f64; 2]) -> f64 {
    (position * error.fixed_rows::<3>(0)).norm_squared()
        + (orientation * error.fixed_rows::<3>(3)).norm_squared()
}

/// A pose that is missing, cut to the clamp's distance and angle: the way starts in the same direction.
fn clamped(missing: &Isometry3<f64>, clamp: Option<FrameError>) -> Isometry3<f64> {
    let Some(clamp) = clamp else { return *missing };
    let (way, turn) = (missing.translation.vector, missing.rotation.scaled_axis());
    let part = |limit: f64, size: f64| (limit / size.max(f64::MIN_POSITIVE)).min(1.0);
    let translation = way * part(clamp.position_m, way.norm());
    let rotation = UnitQuaternion::from_scaled_axis(turn * part(clamp.orientation_rad, turn.norm()));
    Isometry3::from_parts(translation.into(), rotation)
}

fn write_pose_rows(
    scratch: &mut TaskScratch,
    error: &Vector6<f64>,
    [position, orientation]: [f64; 2],
    gain: f64,
    sink: &mut impl Sink,
) {
    for i in 0..6 {
        let weight = if i < 3 { position } else { orientation };
        scratch.entries.clear();
        scratch.entries.extend(scratch.columns.iter().map(|(joint, column)| (*joint, weight * column[i])));
        sink.row(&scratch.entries, weight * gain * error[i]);
    }
}
