//! Robots that carry one object together, in step: all follow one path of the object, and hands give way to the partners.

use tandem_sim::{CONTROL_DT_S, Pose, Sides, Vector};

use super::bar::{BarGrasp, move_together};
use super::ground::{heading_rad, upright, wrapped_rad};
use super::stage::{Hands, RobotMove, Stage, WALK_STEPS};
use super::walk::{Drift, Way, steer, walk_to};
use crate::players::PlayerError;

/// How far behind the bar in its hands a robot stands.
const BEHIND_BAR_M: f32 = 0.29;
/// Towards their places, before anything is held.
const APPROACH_M_S: f32 = 0.3;
const ACCELERATION_M_S2: f32 = 0.3;
/// The slowest that a path is followed.
const CREEP_M_S: f32 = 0.02;
const COMPLIANCE_N_S_M: f64 = 250.0;
/// Robots still correct their places for so long once the object has arrived.
const HOLD_S: f32 = 2.0;
/// Base commands are limited to what a robot does with its hands on a load.
const PACE_M_S: f32 = 0.35;
/// An object that is set down is pressed on the floor by so much.
const PRESS_M: f32 = 0.004;

/// The way of a carried object, by the distance it has gone, and how fast.
pub struct Path<'a> {
    pub at: &'a dyn Fn(f32) -> Pose,
    pub length_m: f32,
    pub pace_m_s: f32,
}

/// Robots and their grasps of one object.
pub struct Team<'a> {
    grasps: &'a [BarGrasp<'a>],
    robots: Vec<usize>,
    /// Where each robot stands, in the object's frame.
    object_from_stand: Vec<Pose>,
    /// Where each hand is, in the object's frame, since it was measured.
    object_from_wrist: Vec<Pose>,
}

impl<'a> Team<'a> {
    /// Robots that have both hands in `grasps`, left first.
    pub fn new(stage: &mut Stage, grasps: &'a [BarGrasp<'a>]) -> Result<Team<'a>, PlayerError> {
        let facts = stage.facts()?;
        let pairs = grasps.chunks_exact(2);
        let stand = |pair: &[BarGrasp]| {
            let bar_m = |grasp: &BarGrasp| facts.site(grasp.object, grasp.bar).position_m();
            let middle_m = (bar_m(&pair[0]) + bar_m(&pair[1])) * 0.5;
            let ahead = upright(&Pose::from_rotation(pair[0].object_from_wrist));
            let behind_m = ahead.rotation * Vector::new(-BEHIND_BAR_M, 0.0, 0.0);
            Pose::from_parts((middle_m + behind_m).with_z(0.0), ahead.rotation)
        };
        Ok(Team {
            grasps,
            robots: pairs.clone().map(|pair| pair[0].robot).collect(),
            object_from_stand: pairs.map(stand).collect(),
            object_from_wrist: Vec::new(),
        })
    }

    fn object(&self, stage: &mut Stage) -> Result<Pose, PlayerError> {
        Ok(stage.facts()?.object(self.grasps[0].object).pose_in_world)
    }

    /// Robots walk to where they stand beside the object as it is now.
    pub fn gather(&self, stage: &mut Stage) -> Result<(), PlayerError> {
        let object = upright(&self.object(stage)?);
        let way = |(robot, stand): (&usize, &Pose)| Way {
            robot: *robot,
            to: object * *stand,
            pace_m_s: APPROACH_M_S,
        };
        let ways: Vec<Way> = self.robots.iter().zip(&self.object_from_stand).map(way).collect();
        walk_to(stage, &ways)
    }

    /// Lifts what all hands hold straight up, and measures the grips.
    pub fn lift(&mut self, stage: &mut Stage, by_m: f32) -> Result<(), PlayerError> {
        let start = self.object(stage)?;
        let raised =
            |share: f32| Pose::from_parts(start.translation + Vector::Z * by_m * share, start.rotation);
        move_together(stage, self.grasps, &raised, 5, 0.3)?;
        move_together(stage, self.grasps, &|_| raised(1.0), 1, 0.4)?;
        let object = self.object(stage)?;
        self.object_from_wrist.clear();
        for grasp in self.grasps {
            let wrist = stage.world_from_wrist(grasp.robot, grasp.side)?;
            self.object_from_wrist.push(object.inverse() * wrist);
        }
        Ok(())
    }

    /// Carries the lifted object along a path.
    pub fn carry(&self, stage: &mut Stage, path: &Path) -> Result<(), PlayerError> {
        let dt_s = WALK_STEPS as f32 * CONTROL_DT_S;
        let (mut gone_m, mut pace_m_s, mut held_s) = (0.0f32, 0.0f32, 0.0f32);
        while held_s < HOLD_S {
            let left_m = path.length_m - gone_m;
            if left_m > 1e-4 {
                let can_stop_m_s = (2.0 * ACCELERATION_M_S2 * left_m).sqrt();
                let most_m_s = path.pace_m_s.min(can_stop_m_s).max(CREEP_M_S);
                pace_m_s = (pace_m_s + ACCELERATION_M_S2 * dt_s).min(most_m_s);
                gone_m += (pace_m_s * dt_s).min(left_m);
            } else {
                pace_m_s = 0.0;
                held_s += dt_s;
            }
            let goal = (path.at)(gone_m);
            let next = (path.at)((gone_m + pace_m_s * dt_s).min(path.length_m));
            self.step(stage, &goal, &next, dt_s)?;
        }
        Ok(())
    }

    /// One command: hands where the object is to be, bases where the robots stand beside it, which goes on to `next`.
    fn step(&self, stage: &mut Stage, goal: &Pose, next: &Pose, dt_s: f32) -> Result<(), PlayerError> {
        let facts = stage.facts()?;
        let mut moves = Vec::with_capacity(self.robots.len());
        for (index, (robot, stand)) in self.robots.iter().zip(&self.object_from_stand).enumerate() {
            let (here, there) = (*goal * *stand, *next * *stand);
            let drift = Drift {
                velocity_m_s: (there.translation - here.translation) / dt_s,
                turning_rad_s: wrapped_rad(heading_rad(&there) - heading_rad(&here)) / dt_s,
            };
            let wrist = |hand: usize| *goal * self.object_from_wrist[2 * index + hand];
            moves.push(RobotMove {
                robot: *robot,
                walk: steer(&facts.robots[*robot].pelvis_in_world, &here, drift, PACE_M_S),
                hands: Hands::World(Sides { left: wrist(0), right: wrist(1) }),
                compliance_n_s_m: Some(COMPLIANCE_N_S_M),
            });
        }
        stage.advance(WALK_STEPS, &moves)
    }

    /// Sets the object down straight below, at a height of its origin.
    pub fn lower(&self, stage: &mut Stage, height_m: f32) -> Result<(), PlayerError> {
        let from = self.object(stage)?;
        let mut down = upright(&from);
        down.translation.z = height_m - PRESS_M;
        move_together(stage, self.grasps, &|share| from.lerp(&down, share), 6, 0.3)
    }
}
