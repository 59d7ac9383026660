//! Grasps of a bar from outside: the fingers go round it, the palm lies on it, and what it belongs to is moved as one.

use std::f32::consts::FRAC_PI_2;

use tandem_sim::{Pose, Rotation, Side, Vector};

use super::commander::{Commander, HandMove};
use super::cylinder::{closed_rad, mirrored_m, open_rad};
use crate::players::PlayerError;
use crate::scoring::Facts;

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

/// Where a 36 mm bar lies in a hand whose palm is on it.
const BAR_IN_WRIST_M: Vector = Vector::new(0.105, 0.042, 0.0);
/// Closed farther than round a bottle: a bar is thinner, and the thumb has to oppose the fingers.
const BAR_CLOSURE: f32 = 1.3;

impl<'a> BarGrasp<'a> {
    /// Both hands of a robot on bars of 36 mm, left and right, palms down, fingers pointing along a heading in the object's
    /// frame.
    pub fn from_above(
        robot: usize,
        object: &'a str,
        bars: [&'a str; 2],
        heading_rad: f32,
    ) -> [BarGrasp<'a>; 2] {
        let grasp = |side: Side, bar| BarGrasp {
            robot,
            side,
            object,
            bar,
            bar_in_wrist_m: BAR_IN_WRIST_M,
            object_from_wrist: Rotation::from_rotation_z(heading_rad)
                * Rotation::from_rotation_x(side.sign() * FRAC_PI_2),
            closure: BAR_CLOSURE,
        };
        [grasp(Side::Left, bars[0]), grasp(Side::Right, bars[1])]
    }

    /// The same for upright bars: palms towards each other. See [`BarGrasp::from_above`].
    pub fn between(robot: usize, object: &'a str, bars: [&'a str; 2], heading_rad: f32) -> [BarGrasp<'a>; 2] {
        let upright = Rotation::from_rotation_z(heading_rad);
        BarGrasp::from_above(robot, object, bars, heading_rad)
            .map(|grasp| BarGrasp { object_from_wrist: upright, ..grasp })
    }
}

impl BarGrasp<'_> {
    /// Wrist motion to the bar, `standoff_m` short of it.
    fn reach(&self, commander: &mut Commander, standoff_m: f32) -> Result<HandMove, PlayerError> {
        let facts = commander.facts()?;
        let bar_in_wrist_m = mirrored_m(self.bar_in_wrist_m + Vector::new(0.0, standoff_m, 0.0), self.side);
        let bar_m = facts.site(self.object, self.bar).position_m();
        let origin_m = bar_m - self.object_from_wrist * bar_in_wrist_m;
        let world_from_object = facts.object(self.object).pose_in_world;
        let wrist = world_from_object * Pose::from_parts(origin_m, self.object_from_wrist);
        Ok(HandMove::reach(self.robot, self.side, wrist))
    }

    /// Open hand, `standoff_m` short of the bar.
    pub fn before(&self, commander: &mut Commander, standoff_m: f32) -> Result<HandMove, PlayerError> {
        Ok(self.reach(commander, standoff_m)?.shaped(open_rad(self.side)))
    }

    /// Palm on the bar.
    pub fn around(&self, commander: &mut Commander) -> Result<HandMove, PlayerError> {
        self.reach(commander, 0.0)
    }

    pub fn close(&self) -> HandMove {
        self.closing(1.0)
    }

    /// Fingers on their way from open to closed.
    pub fn closing(&self, share: f32) -> HandMove {
        let (open_rad, closed_rad) = (open_rad(self.side), closed_rad(self.side));
        let between = |i: usize| open_rad[i] + (closed_rad[i] * self.closure - open_rad[i]) * share;
        HandMove::shape(self.robot, self.side, std::array::from_fn(between))
    }

    pub fn open(&self) -> HandMove {
        HandMove::shape(self.robot, self.side, open_rad(self.side))
    }

    /// Whether this very hand holds its object.
    pub fn is_held(&self, facts: &Facts) -> bool {
        facts.holds(self.robot, self.side, self.object)
    }

    pub fn holds(&self, commander: &mut Commander) -> Result<bool, PlayerError> {
        Ok(commander.facts()?.holds_any(self.robot, self.object))
    }
}

const ATTEMPTS: usize = 4;
/// How far from a bar hands begin to come at it.
const STANDOFF_M: f32 = 0.08;

/// Closes all hands on their bars at once; hands that miss try again.
pub fn take_together(commander: &mut Commander, grasps: &[BarGrasp]) -> Result<(), PlayerError> {
    let each = |commander: &mut Commander,
                part: fn(&BarGrasp, &mut Commander) -> Result<HandMove, PlayerError>| {
        grasps.iter().map(|grasp| part(grasp, commander)).collect::<Result<Vec<_>, _>>()
    };
    for _ in 0..ATTEMPTS {
        let before = each(commander, |grasp, commander| grasp.before(commander, STANDOFF_M))?;
        commander.perform(1.4, &before)?;
        let around = each(commander, |grasp, commander| grasp.around(commander))?;
        commander.perform(0.8, &around)?;
        let close: Vec<HandMove> = grasps.iter().map(BarGrasp::close).collect();
        commander.perform(0.8, &close)?;
        commander.perform(0.4, &close)?;
        let mut held = true;
        for grasp in grasps {
            held &= grasp.holds(commander)?;
        }
        if held {
            return Ok(());
        }
        let open: Vec<HandMove> = grasps.iter().map(BarGrasp::open).collect();
        commander.perform(0.5, &open)?;
    }
    Err(PlayerError::GaveUp("not every hand could take its bar".into()))
}

/// Brings an object that all `grasps` hold to a pose (world) in `legs` short straight moves, so that hands and object
/// stay together on a path that turns.
pub fn move_together(
    commander: &mut Commander,
    grasps: &[BarGrasp],
    path: &dyn Fn(f32) -> Pose,
    legs: u32,
    leg_s: f32,
) -> Result<(), PlayerError> {
    let Some(first) = grasps.first() else { return Ok(()) };
    // The grips are measured once: following the object's own lag would let hands drift apart.
    let object = commander.facts()?.object(first.object).pose_in_world;
    let mut grips = Vec::with_capacity(grasps.len());
    for grasp in grasps {
        grips.push(object.inverse() * commander.world_from_wrist(grasp.robot, grasp.side)?);
    }
    for leg in 1..=legs {
        let goal = path(leg as f32 / legs as f32);
        let moves: Vec<HandMove> = grasps
            .iter()
            .zip(&grips)
            .map(|(grasp, grip)| HandMove::reach(grasp.robot, grasp.side, goal * *grip))
            .collect();
        commander.glide(leg_s, &moves)?;
    }
    Ok(())
}
