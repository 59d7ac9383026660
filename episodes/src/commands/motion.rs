//! What moves one robot: its joint targets, and the inverse kinematics that makes them follow wrist poses.

use std::sync::Arc;

use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};
use tandem_ik::{Configuration, Outcome, SolveOptions, SolveReport, Solver};
use tandem_sim::{BaseCommand, BaseLimits, HAND_JOINTS, RobotCommand, RobotModel, Side, Sides, UPPER_JOINTS};

use super::columns;
use super::upper_body::{REACH_TOLERANCE, UpperBody};

/// Part of the remaining error that one control step removes: smooth, and a lag of two steps.
const GAIN: f64 = 0.5;
const REACH_RESTARTS: usize = 8;

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
    /// Where the wrists are to be, pelvis frame.
    pub(super) targets: Sides<Isometry3<f64>>,
    /// What the solver remembers of steps that did not help; see [`Solver::caution`].
    caution: f64,
    /// Joints follow `targets`; otherwise the last joint chunk's row holds.
    pub(super) follows_wrists: bool,
}

impl Motion {
    /// A robot that stands under `rest`.
    pub fn new(robot: RobotSheet, body: &Arc<UpperBody>, rest: &RobotCommand) -> Motion {
        let state = MotionState {
            upper_rad: rest.upper_rad.map(f64::from),
            base: rest.base,
            targets: Sides::both(Isometry3::identity()),
            caution: 1.0,
            follows_wrists: true,
        };
        let mut motion = Motion { robot, solver: body.solver(), body: body.clone(), state };
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
    pub fn targets(&self) -> &Sides<Isometry3<f64>> {
        &self.state.targets
    }

    /// The base stands at the height that it was last told.
    pub(super) fn stand(&mut self) {
        let pelvis_height_m = self.state.base.pelvis_height_m;
        self.state.base = BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m };
    }

    pub(super) fn walk(&mut self, base: BaseCommand) {
        self.state.base = base;
    }

    /// New wrist targets; one that is `None` stays, or is where the last joint chunk left its wrist.
    pub(super) fn aim(&mut self, wrists: &Sides<Option<Isometry3<f64>>>) {
        let commanded = self.commanded_wrists();
        for side in Side::BOTH {
            if let Some(target) = wrists[side] {
                if !self.state.follows_wrists {
                    self.state.targets = commanded;
                }
                self.state.targets[side] = target;
                self.state.follows_wrists = true;
            }
        }
    }

    pub(super) fn set_joints(&mut self, upper_rad: [f64; UPPER_JOINTS]) {
        self.state.upper_rad = upper_rad;
        self.state.follows_wrists = false;
        self.state.targets = self.commanded_wrists();
    }

    pub(super) fn set_fingers(&mut self, side: Side, fingers_rad: &[f64; HAND_JOINTS]) {
        self.state.upper_rad[columns::hand(side)].copy_from_slice(fingers_rad);
    }

    /// Where the commanded joints put the wrists, pelvis frame.
    pub(super) fn commanded_wrists(&self) -> Sides<Isometry3<f64>> {
        let configuration = self.configuration();
        self.body.wrists.map(|wrist| configuration.root_from_frame(wrist))
    }

    /// Joint targets for one step towards `targets`, unless the joints hold a chunk's last row.
    ///
    /// Inverse kinematics begins at the commanded, not at the measured joints: gravity's sag does not wind up.
    pub(super) fn follow(&mut self, targets: &Sides<Isometry3<f64>>) {
        if !self.state.follows_wrists {
            return;
        }
        let body = self.body.clone();
        let tasks = body.tasks(targets, GAIN);
        let mut configuration = configuration(&body, &self.state);
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

    /// Whether the wrists would get to `targets` from here, and the joints that would be at their limits.
    pub fn reach(&self, targets: &Sides<Isometry3<f64>>) -> (SolveReport, Vec<String>) {
        let mut solver = self.body.solver();
        solver.tolerance = REACH_TOLERANCE;
        let mut configuration = self.configuration();
        let options = SolveOptions { restarts: REACH_RESTARTS, ..SolveOptions::default() };
        let report = solver.solve(&mut configuration, &self.body.tasks(targets, 1.0), &options);
        let at_limit = tandem_ik::saturated(&configuration);
        let names = at_limit.iter().map(|joint| self.body.model.joints()[*joint].name.clone()).collect();
        (report, names)
    }

    fn configuration(&self) -> Configuration<'_> {
        configuration(&self.body, &self.state)
    }
}

fn configuration<'a>(body: &'a UpperBody, state: &MotionState) -> Configuration<'a> {
    let q: Vec<f64> = body.columns.iter().map(|column| state.upper_rad[*column]).collect();
    Configuration::new(&body.model, &q).expect("one finite target per joint")
}
