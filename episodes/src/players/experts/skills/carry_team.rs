//! Robots that carry one object together, in step: all follow one path of the object, and hands give way to the partners.
//! One robot that carries or pushes something with both hands is the smallest team.

use tandem_sim::{Pose, Rotation, Sides, Vector, heading_rad, wrapped_rad};

use super::commander::{Commander, HandMove};
use super::grasps::{HandGrasp, grasp_compliantly, move_together};
use super::posture_path::{FREE, PathProgress, Posture, PosturePath, follow_while};
use super::walk::{Tolerance, WalkGoal, approach, at_height, upright, walk_reaching};
use super::walked_way::WalkedWay;
use crate::players::PlayerError;
use crate::scoring::{Facts, Grip};

/// How fast robots walk to their places before anything is held. Hands that reach out correct the rest.
const APPROACH_M_S: f32 = 0.3;
const NEAR: Tolerance = Tolerance { off_m: 0.03, off_rad: 0.05 };
/// How far hands give way, which two robots that walk with a load need.
pub const COMPLIANCE_N_S_M: f64 = 250.0;
/// Robots still correct their places for so long once the object has arrived.
const HOLD_S: f32 = 0.4;
/// How long robots rest: feet come together, and what pulls between the hands fades.
const REST_S: f32 = 0.6;
/// A hand has lost what it does not touch for so many commands; the robots then rest, and take it again no more often.
const LOST_BEATS: u32 = 5;
const CARRIES: u32 = 4;
/// An object that is set down is pressed on the floor by so much.
const PRESS_M: f32 = 0.004;
/// It is set down once it is over its place within this, or has been moved there so many times.
const OVER_M: f32 = 0.015;
const OVER_RAD: f32 = 0.02;
const MAX_MOVES_OVER: u32 = 3;

/// Where a carried object is by the distance it has gone, and how fast it goes.
pub struct ObjectPath<'a> {
    pub at: &'a dyn Fn(f32) -> Pose,
    pub length_m: f32,
    pub pace_m_s: f32,
    /// How much of it may have been gone by now.
    pub free_m: &'a dyn Fn(&Facts) -> f32,
}

/// Robots and their grasps of one object.
pub struct CarryTeam<'a> {
    grasps: &'a [HandGrasp<'a>],
    robots: Vec<usize>,
    /// Where each robot stands, in the object's frame.
    object_from_stand: Vec<Pose>,
    /// Where each hand is, in the object's frame, since it was measured.
    object_from_wrist: Vec<Pose>,
}

impl<'a> CarryTeam<'a> {
    /// Robots that have both hands in `grasps`, left first.
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

    /// The object as it is now.
    pub fn object(&self, commander: &mut Commander) -> Result<Pose, PlayerError> {
        Ok(commander.facts()?.object(self.grasps[0].object).pose_in_world)
    }

    /// Robots walk to where they stand beside the object as it is now.
    pub fn gather(&self, commander: &mut Commander) -> Result<(), PlayerError> {
        let walk_goals = self.walk_goals(commander)?;
        approach(commander, &walk_goals, NEAR)
    }

    /// Robots walk to where they stand beside the object as it is now, and reach out to the first stops of their hands meanwhile.
    pub fn gather_reaching(&self, commander: &mut Commander) -> Result<(), PlayerError> {
        let walk_goals = self.walk_goals(commander)?;
        let mut reaches = Vec::with_capacity(walk_goals.len());
        for pair in self.grasps.chunks_exact(2) {
            let [left, right] = [pair[0].at_stop(commander, 0)?, pair[1].at_stop(commander, 0)?];
            reaches.push(Sides { left, right });
        }
        walk_reaching(commander, &walk_goals, &reaches)
    }

    /// Where the robots have to walk to stand beside the object as it is now.
    fn walk_goals(&self, commander: &mut Commander) -> Result<Vec<WalkGoal>, PlayerError> {
        let object = upright(&self.object(commander)?);
        let way = |(robot, stand): (&usize, &Pose)| WalkGoal {
            robot: *robot,
            to: object * *stand,
            pace_m_s: APPROACH_M_S,
        };
        Ok(self.robots.iter().zip(&self.object_from_stand).map(way).collect())
    }

    /// Remembers where in the object's frame the hands are that hold it.
    pub fn measure(&mut self, commander: &mut Commander) -> Result<(), PlayerError> {
        let object = self.object(commander)?;
        self.object_from_wrist.clear();
        for grasp in self.grasps {
            let wrist = commander.world_from_wrist(grasp.robot, grasp.side)?;
            self.object_from_wrist.push(object.inverse() * wrist);
        }
        Ok(())
    }

    /// Lifts what all hands hold straight up, and measures the grips.
    pub fn lift(&mut self, commander: &mut Commander, by_m: f32) -> Result<(), PlayerError> {
        let start = self.object(commander)?;
        let raised =
            |share: f32| Pose::from_parts(start.translation + Vector::Z * by_m * share, start.rotation);
        move_together(commander, self.grasps, &raised, 5, 0.2)?;
        move_together(commander, self.grasps, &|_| raised(1.0), 1, 0.2)?;
        self.measure(commander)
    }

    /// Takes the held object along a path, at the end of which it stays for a moment. Hands that lose it on the way take it
    /// again.
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

    /// Takes the held object through stops, world frame; `pace_m_s` is that of the robot that has farthest to walk.
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

    /// Grasps whose hands do not even touch the object.
    fn hands_off(&self, facts: &Facts) -> impl Iterator<Item = HandGrasp<'a>> {
        let off = |grasp: &HandGrasp| facts.object(grasp.object).hands[grasp.robot][grasp.side] == Grip::Off;
        self.grasps.iter().copied().filter(off).collect::<Vec<_>>().into_iter()
    }

    /// The robots stand, the hands that have lost the object take it where it is now, and all bring it back to its way.
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

    /// Takes the held object straight over a place, as high as it is.
    pub fn carry_to(
        &mut self,
        commander: &mut Commander,
        place: &Pose,
        pace_m_s: f32,
    ) -> Result<(), PlayerError> {
        self.carry_where_free(commander, place, pace_m_s, &FREE)
    }

    /// The same as [`CarryTeam::carry_to`], no farther than is free by now.
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

    /// How the robots stand and hold the object where it is to be.
    fn postures(&self, world_from_object: &Pose) -> Vec<Posture> {
        let hand = |hand: usize| *world_from_object * self.object_from_wrist[hand];
        let posture = |(index, (robot, stand)): (usize, (&usize, &Pose))| Posture {
            robot: *robot,
            stand: *world_from_object * *stand,
            wrists: Sides { left: hand(2 * index), right: hand(2 * index + 1) },
        };
        self.robots.iter().zip(&self.object_from_stand).enumerate().map(posture).collect()
    }

    /// All stand still with what they hold. Set down without it, a load that robots pull to and fro as they stop is dragged
    /// along.
    pub fn rest(&self, commander: &mut Commander) -> Result<(), PlayerError> {
        let still: Vec<HandMove> =
            self.grasps.iter().map(|grasp| HandMove::still(grasp.robot, grasp.side)).collect();
        commander.perform(REST_S, &still)
    }

    /// Sets the object down: over its place first, for which hands must not give way, until it is seen to be there; then straight
    /// below.
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

    /// Whether hands give way to partners from now on. One who has no partner gives way to nobody.
    pub fn give_way(&self, commander: &mut Commander, give_way: bool) {
        let compliance_n_s_m = (give_way && self.robots.len() > 1).then_some(COMPLIANCE_N_S_M);
        for robot in &self.robots {
            commander.set_compliance(*robot, compliance_n_s_m);
        }
    }
}

/// Whether an object is over a place, seen from above.
fn is_over(object: &Pose, place: &Pose) -> bool {
    let off_m = (object.translation - place.translation).truncate().length();
    off_m < OVER_M && wrapped_rad(heading_rad(object) - heading_rad(place)).abs() < OVER_RAD
}
