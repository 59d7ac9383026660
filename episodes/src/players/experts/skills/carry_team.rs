//! Robots that carry one object together, in step: all follow one path of the object, and hands yield to the
//! partners. A single robot that carries or pushes an object with both hands is the smallest team.

use tandem_sim::{Pose, Rotation, Sides, Vector, heading_rad, wrapped_rad};

use super::commander::{Commander, HandMove};
use super::grasps::{HandGrasp, grasp_compliantly, move_together};
use super::posture_path::{FREE, PathProgress, Posture, PosturePath, follow_while};
use super::walk::{Tolerance, WalkGoal, approach, at_height, upright, walk_reaching};
use super::walked_way::WalkedWay;
use crate::players::PlayerError;
use crate::scoring::{Facts, Grip};

/// Speed at which robots walk to their places before they hold the object. Hands that reach out correct the
/// remaining error.
const APPROACH_M_S: f32 = 0.3;
const NEAR: Tolerance = Tolerance { off_m: 0.03, off_rad: 0.05 };
/// Compliance of the hands, which two robots need to walk with a load.
pub const COMPLIANCE_N_S_M: f64 = 250.0;
/// Time for which robots still correct their places once the object has reached its goal.
const HOLD_S: f32 = 0.4;
/// Duration of a rest: feet come together, and the tension between the hands fades.
const REST_S: f32 = 0.6;
/// Number of commands without touch after which a hand has lost the object. The robots then rest and take
/// it again, for at most `CARRIES` attempts in all.
const LOST_BEATS: u32 = 5;
const CARRIES: u32 = 4;
/// Depth by which an object that is set down is pressed into the floor.
const PRESS_M: f32 = 0.004;
/// Tolerance within which the object is over its place, and is set down; after `MAX_MOVES_OVER` moves it is
/// set down anyway.
const OVER_M: f32 = 0.015;
const OVER_RAD: f32 = 0.02;
const MAX_MOVES_OVER: u32 = 3;

/// Pose of a carried object as a function of the distance travelled, and its pace.
pub struct ObjectPath<'a> {
    pub at: &'a dyn Fn(f32) -> Pose,
    pub length_m: f32,
    pub pace_m_s: f32,
    /// Distance along the path that is free at present.
    pub free_m: &'a dyn Fn(&Facts) -> f32,
}

/// Robots and their grasps of one object.
pub struct CarryTeam<'a> {
    grasps: &'a [HandGrasp<'a>],
    robots: Vec<usize>,
    /// Place of each robot on the floor, in the object's frame.
    object_from_stand: Vec<Pose>,
    /// Pose of each hand in the object's frame, since the last measurement.
    object_from_wrist: Vec<Pose>,
}

impl<'a> CarryTeam<'a> {
    /// Creates the team of the robots that have both hands in `grasps`, left first.
    pub fn new(commander: &mut Commander, grasps: &'a [HandGrasp<'a>]) -> Result<CarryTeam<'a>, PlayerError> {
        let facts = commander.facts()?;
        let pairs = grasps.chunks_exact(2);
        let stand = |pair: &[HandGrasp]| {
            let place_m = |grasp: &HandGrasp| facts.site(grasp.object, grasp.place).position_m();
            let middle_m = (place_m(&pair[0]) + place_m(&pair[1])) * 0.5;
            let ahead = Pose::from_rotation(Rotation::from_rotation_z(pair[0].heading_rad));
            let back_m = ahead.rotation * Vector::new(-pair[0].hold.behind_m, 0.0, 0.0);
            Pose::from_parts((middle_m + back_m).with_z(0.0), ahead.rotation)
        };
        Ok(CarryTeam {
            grasps,
            robots: pairs.clone().map(|pair| pair[0].robot).collect(),
            object_from_stand: pairs.map(stand).collect(),
            object_from_wrist: Vec::new(),
        })
    }

    /// Returns the object's present pose.
    pub fn object(&self, commander: &mut Commander) -> Result<Pose, PlayerError> {
        Ok(commander.facts()?.object(self.grasps[0].object).pose_in_world)
    }

    /// Walks the robots to their places beside the object, by its present pose.
    pub fn gather(&self, commander: &mut Commander) -> Result<(), PlayerError> {
        let walk_goals = self.walk_goals(commander)?;
        approach(commander, &walk_goals, NEAR)
    }

    /// Walks the robots to their places beside the object, by its present pose. Their hands reach out to
    /// their first stops meanwhile.
    pub fn gather_reaching(&self, commander: &mut Commander) -> Result<(), PlayerError> {
        let walk_goals = self.walk_goals(commander)?;
        let mut reaches = Vec::with_capacity(walk_goals.len());
        for pair in self.grasps.chunks_exact(2) {
            let [left, right] = [pair[0].at_stop(commander, 0)?, pair[1].at_stop(commander, 0)?];
            reaches.push(Sides { left, right });
        }
        walk_reaching(commander, &walk_goals, &reaches)
    }

    /// Returns the walk goals that put the robots beside the object in its present pose.
    fn walk_goals(&self, commander: &mut Commander) -> Result<Vec<WalkGoal>, PlayerError> {
        let object = upright(&self.object(commander)?);
        let way = |(robot, stand): (&usize, &Pose)| WalkGoal {
            robot: *robot,
            to: object * *stand,
            pace_m_s: APPROACH_M_S,
        };
        Ok(self.robots.iter().zip(&self.object_from_stand).map(way).collect())
    }

    /// Stores the poses of the holding hands in the object's frame.
    pub fn measure(&mut self, commander: &mut Commander) -> Result<(), PlayerError> {
        let object = self.object(commander)?;
        self.object_from_wrist.clear();
        for grasp in self.grasps {
            let wrist = commander.world_from_wrist(grasp.robot, grasp.side)?;
            self.object_from_wrist.push(object.inverse() * wrist);
        }
        Ok(())
    }

    /// Lifts the object that all hands hold straight up, and measures the grips.
    pub fn lift(&mut self, commander: &mut Commander, by_m: f32) -> Result<(), PlayerError> {
        let start = self.object(commander)?;
        let raised =
            |share: f32| Pose::from_parts(start.translation + Vector::Z * by_m * share, start.rotation);
        move_together(commander, self.grasps, &raised, 5, 0.2)?;
        move_together(commander, self.grasps, &|_| raised(1.0), 1, 0.2)?;
        self.measure(commander)
    }

    /// Takes the held object along a path, and holds it at the end for a moment. Hands that lose it on the
    /// way take it again.
    ///
    /// # Errors
    ///
    /// If the hands lose the object again and again.
    pub fn carry(&mut self, commander: &mut Commander, path: &ObjectPath) -> Result<(), PlayerError> {
        let ObjectPath { length_m, pace_m_s, free_m, .. } = *path;
        let pace_m_s = pace_m_s * commander.walking();
        let mut from_m = 0.0;
        for _ in 0..CARRIES {
            self.give_way(commander, true);
            let at = |gone_m: f32| self.postures(&(path.at)(gone_m));
            let postures = PosturePath { at: &at, length_m, pace_m_s, hold_s: HOLD_S, free_m };
            let mut off_beats = 0;
            let mut well = |facts: &Facts| {
                off_beats = if self.hands_off(facts).next().is_some() { off_beats + 1 } else { 0 };
                off_beats < LOST_BEATS
            };
            match follow_while(commander, &postures, from_m, &mut well)? {
                PathProgress::Completed => return Ok(()),
                PathProgress::Interrupted { gone_m } => from_m = gone_m,
            }
            self.take_again(commander, &(path.at)(from_m))?;
        }
        Err(PlayerError::GaveUp("hands lost the load again and again".into()))
    }

    /// Carries the held object through stops in the world frame. `pace_m_s` is the pace of the robot with the
    /// longest way.
    pub fn carry_by(
        &mut self,
        commander: &mut Commander,
        stops: &[Pose],
        pace_m_s: f32,
    ) -> Result<(), PlayerError> {
        let mut all = vec![upright(&self.object(commander)?)];
        all.extend(stops);
        let way = WalkedWay::new(&all, &self.object_from_stand);
        let at = |gone_m: f32| way.at(gone_m);
        self.carry(commander, &ObjectPath { at: &at, length_m: way.length_m(), pace_m_s, free_m: &FREE })
    }

    /// Returns the grasps whose hands do not even touch the object.
    fn hands_off(&self, facts: &Facts) -> impl Iterator<Item = HandGrasp<'a>> {
        let off = |grasp: &HandGrasp| facts.object(grasp.object).hands[grasp.robot][grasp.side] == Grip::Off;
        self.grasps.iter().copied().filter(off).collect::<Vec<_>>().into_iter()
    }

    /// Stops the robots, regrasps the object where it is now with the hands that have lost it, and returns it
    /// to its path.
    fn take_again(&mut self, commander: &mut Commander, on_its_way: &Pose) -> Result<(), PlayerError> {
        self.rest(commander)?;
        let lost: Vec<HandGrasp> = self.hands_off(&commander.facts()?).collect();
        if !lost.is_empty() {
            grasp_compliantly(commander, &lost)?;
        }
        let now = self.object(commander)?;
        move_together(commander, self.grasps, &|share| now.lerp(on_its_way, share), 4, 0.2)?;
        self.measure(commander)
    }

    /// Takes the held object straight over a place at its present height.
    pub fn carry_to(
        &mut self,
        commander: &mut Commander,
        place: &Pose,
        pace_m_s: f32,
    ) -> Result<(), PlayerError> {
        self.carry_where_free(commander, place, pace_m_s, &FREE)
    }

    /// Takes the object to a place like [`CarryTeam::carry_to`], but only as far as the path is free.
    pub fn carry_where_free(
        &mut self,
        commander: &mut Commander,
        place: &Pose,
        pace_m_s: f32,
        free_m: &dyn Fn(&Facts) -> f32,
    ) -> Result<(), PlayerError> {
        let from = upright(&self.object(commander)?);
        let over = at_height(place, from.translation.z);
        let length_m = (over.translation - from.translation).length();
        let at = |gone_m: f32| from.lerp(&over, gone_m / length_m);
        self.carry(commander, &ObjectPath { at: &at, length_m, pace_m_s, free_m })
    }

    /// Returns the postures of the robots and their hands for an object pose.
    fn postures(&self, world_from_object: &Pose) -> Vec<Posture> {
        let hand = |hand: usize| *world_from_object * self.object_from_wrist[hand];
        let posture = |(index, (robot, stand)): (usize, (&usize, &Pose))| Posture {
            robot: *robot,
            stand: *world_from_object * *stand,
            wrists: Sides { left: hand(2 * index), right: hand(2 * index + 1) },
        };
        self.robots.iter().zip(&self.object_from_stand).enumerate().map(posture).collect()
    }

    /// Holds all robots still with their load. A load that is set down without a rest is dragged along as
    /// the robots stop.
    pub fn rest(&self, commander: &mut Commander) -> Result<(), PlayerError> {
        let still: Vec<HandMove> =
            self.grasps.iter().map(|grasp| HandMove::still(grasp.robot, grasp.side)).collect();
        commander.perform(REST_S, &still)
    }

    /// Sets the object down: first over its place with stiff hands, until it is observed there; then
    /// straight below.
    pub fn set_down(&self, commander: &mut Commander, place: &Pose) -> Result<(), PlayerError> {
        self.give_way(commander, false);
        let mut object = self.object(commander)?;
        for _ in 0..MAX_MOVES_OVER {
            let over = at_height(place, object.translation.z);
            move_together(commander, self.grasps, &|share| object.lerp(&over, share), 4, 0.15)?;
            object = self.object(commander)?;
            if is_over(&object, place) {
                break;
            }
        }
        let over = at_height(place, object.translation.z);
        let down = Pose::from_parts(place.translation - Vector::Z * PRESS_M, place.rotation);
        move_together(commander, self.grasps, &|share| over.lerp(&down, share), 5, 0.22)?;
        self.give_way(commander, true);
        Ok(())
    }

    /// Makes the hands compliant to partners from now on, or stiff. A robot without a partner stays stiff.
    pub fn give_way(&self, commander: &mut Commander, give_way: bool) {
        let compliance_n_s_m = (give_way && self.robots.len() > 1).then_some(COMPLIANCE_N_S_M);
        for robot in &self.robots {
            commander.set_compliance(*robot, compliance_n_s_m);
        }
    }
}

/// Returns `true` if an object is over a place, seen from above.
fn is_over(object: &Pose, place: &Pose) -> bool {
    let off_m = (object.translation - place.translation).truncate().length();
    off_m < OVER_M && wrapped_rad(heading_rad(object) - heading_rad(place)).abs() < OVER_RAD
}
