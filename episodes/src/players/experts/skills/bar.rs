//! Grasps of a bar from outside: the fingers go round it, the palm lies on it, and what it belongs to is moved as one.

use tandem_sim::{Pose, Rotation, Side, Vector};

use super::hand::{closed_rad, mirrored_m, open_rad};
use super::stage::{HandMove, Stage};
use crate::players::PlayerError;

/// A hand that is to hold a bar, which lies along the hand's own z axis.
#[derive(Clone, Copy)]
pub struct BarGrasp<'a> {
    pub robot: usize,
    pub side: Side,
    pub object: &'a str,
    /// Site of the object in the middle of the bar.
    pub bar: &'a str,
    /// Where the bar's axis lies in a right wrist's frame; a left hand mirrors it.
    pub bar_in_wrist_m: Vector,
    /// The wrist's rotation in the object's frame.
    pub object_from_wrist: Rotation,
    /// How far the fingers close, 1 for a 7 cm cylinder.
    pub closure: f32,
}

impl BarGrasp<'_> {
    /// Wrist motion to the bar, `standoff_m` short of it.
    fn reach(&self, stage: &mut Stage, standoff_m: f32) -> Result<HandMove, PlayerError> {
        let facts = stage.facts()?;
        let bar_in_wrist_m = mirrored_m(self.bar_in_wrist_m + Vector::new(0.0, standoff_m, 0.0), self.side);
        let bar_m = facts.site(self.object, self.bar).position_m();
        let origin_m = bar_m - self.object_from_wrist * bar_in_wrist_m;
        let world_from_object = facts.object(self.object).pose_in_world;
        let wrist = world_from_object * Pose::from_parts(origin_m, self.object_from_wrist);
        Ok(HandMove::reach(self.robot, self.side, wrist))
    }

    /// Open hand, `standoff_m` short of the bar.
    pub fn before(&self, stage: &mut Stage, standoff_m: f32) -> Result<HandMove, PlayerError> {
        Ok(self.reach(stage, standoff_m)?.shaped(open_rad(self.side)))
    }

    /// Palm on the bar.
    pub fn around(&self, stage: &mut Stage) -> Result<HandMove, PlayerError> {
        self.reach(stage, 0.0)
    }

    pub fn close(&self) -> HandMove {
        HandMove::shape(
            self.robot,
            self.side,
            closed_rad(self.side).map(|angle_rad| angle_rad * self.closure),
        )
    }

    pub fn open(&self) -> HandMove {
        HandMove::shape(self.robot, self.side, open_rad(self.side))
    }

    pub fn holds(&self, stage: &mut Stage) -> Result<bool, PlayerError> {
        Ok(stage.facts()?.holds_any(self.robot, self.object))
    }
}

const ATTEMPTS: usize = 4;
/// From here hands come at bars.
const STANDOFF_M: f32 = 0.08;

/// Closes all hands on their bars at once; hands that miss try again.
pub fn take_together(stage: &mut Stage, grasps: &[BarGrasp]) -> Result<(), PlayerError> {
    let each = |stage: &mut Stage, part: fn(&BarGrasp, &mut Stage) -> Result<HandMove, PlayerError>| {
        grasps.iter().map(|grasp| part(grasp, stage)).collect::<Result<Vec<_>, _>>()
    };
    for _ in 0..ATTEMPTS {
        let before = each(stage, |grasp, stage| grasp.before(stage, STANDOFF_M))?;
        stage.perform(1.4, &before)?;
        let around = each(stage, |grasp, stage| grasp.around(stage))?;
        stage.perform(0.8, &around)?;
        let close: Vec<HandMove> = grasps.iter().map(BarGrasp::close).collect();
        stage.perform(0.8, &close)?;
        stage.perform(0.4, &close)?;
        let mut held = true;
        for grasp in grasps {
            held &= grasp.holds(stage)?;
        }
        if held {
            return Ok(());
        }
        let open: Vec<HandMove> = grasps.iter().map(BarGrasp::open).collect();
        stage.perform(0.5, &open)?;
    }
    Err(PlayerError::GaveUp("not every hand could take its bar".into()))
}

/// Brings an object that all `grasps` hold to a pose (world) in `legs` short straight moves, so that hands and object
/// stay together on a path that turns.
pub fn move_together(
    stage: &mut Stage,
    grasps: &[BarGrasp],
    path: &dyn Fn(f32) -> Pose,
    legs: u32,
    leg_s: f32,
) -> Result<(), PlayerError> {
    let Some(first) = grasps.first() else { return Ok(()) };
    // The grips are measured once: following the object's own lag would let hands drift apart.
    let object = stage.facts()?.object(first.object).pose_in_world;
    let mut grips = Vec::with_capacity(grasps.len());
    for grasp in grasps {
        grips.push(object.inverse() * stage.world_from_wrist(grasp.robot, grasp.side)?);
    }
    for leg in 1..=legs {
        let goal = path(leg as f32 / legs as f32);
        let moves: Vec<HandMove> = grasps
            .iter()
            .zip(&grips)
            .map(|(grasp, grip)| HandMove::reach(grasp.robot, grasp.side, goal * *grip))
            .collect();
        stage.glide(leg_s, &moves)?;
    }
    Ok(())
}
