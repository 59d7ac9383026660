//! Grasps of places of an object, as a [`Hold`] has it; what the places belong to is moved as one.

use tandem_sim::{Pose, Rotation, Side, Vector};

use super::cylinder::{back_off, mirrored, mirrored_m};
use super::hold::Hold;
use crate::players::PlayerError;
use crate::players::experts::skills::commander::{Commander, HandMove};
use crate::scoring::Facts;

/// A hand that is to hold a place of an object.
#[derive(Clone, Copy)]
pub struct HandGrasp<'a> {
    pub robot: usize,
    pub side: Side,
    pub object: &'a str,
    /// Site of the object.
    pub place: &'a str,
    pub hold: Hold,
    /// The way that the robot faces, in the object's frame.
    pub heading_rad: f32,
}

impl<'a> HandGrasp<'a> {
    /// Both hands of a robot that faces along a heading in the object's frame, each on its place, left first.
    pub fn with_both_hands(
        robot: usize,
        object: &'a str,
        places: [&'a str; 2],
        heading_rad: f32,
        hold: &Hold,
    ) -> [HandGrasp<'a>; 2] {
        let grasp = |side, place| HandGrasp { robot, side, object, place, hold: *hold, heading_rad };
        [grasp(Side::Left, places[0]), grasp(Side::Right, places[1])]
    }
}

impl HandGrasp<'_> {
    /// The wrist's rotation in the object's frame.
    fn object_from_wrist(&self) -> Rotation {
        let [yaw_rad, pitch_rad, roll_rad] = self.hold.turned_rad;
        Rotation::from_rotation_z(self.heading_rad - self.side.sign() * yaw_rad)
            * Rotation::from_rotation_y(pitch_rad)
            * Rotation::from_rotation_x(-self.side.sign() * roll_rad)
    }

    /// Wrist motion to where the place is `off_m` farther off than it is held, in a right wrist's frame.
    fn reach(&self, commander: &mut Commander, off_m: Vector) -> Result<HandMove, PlayerError> {
        let facts = commander.facts()?;
        let object_from_wrist = self.object_from_wrist();
        let place_in_wrist_m = mirrored_m(self.hold.place_in_wrist_m + off_m, self.side);
        let place_m = facts.site(self.object, self.place).position_m();
        let origin_m = place_m - object_from_wrist * place_in_wrist_m;
        let world_from_object = facts.object(self.object).pose_in_world;
        let wrist = world_from_object * Pose::from_parts(origin_m, object_from_wrist);
        Ok(HandMove::reach(self.robot, self.side, wrist))
    }

    /// Open hand at a stop on its way in.
    pub fn at_stop(&self, commander: &mut Commander, stop: usize) -> Result<HandMove, PlayerError> {
        Ok(self.reach(commander, self.hold.stops_m[stop])?.shaped(self.open_rad()))
    }

    /// The hand where it closes.
    pub fn around(&self, commander: &mut Commander) -> Result<HandMove, PlayerError> {
        self.reach(commander, Vector::ZERO)
    }

    /// From where the hand is to where what it let go of is `off_m` farther off, in a right wrist's frame.
    pub fn off(&self, commander: &mut Commander, off_m: Vector) -> Result<HandMove, PlayerError> {
        back_off(commander, self.robot, self.side, off_m)
    }

    fn open_rad(&self) -> [f32; 7] {
        mirrored(self.hold.open_rad, self.side)
    }

    pub fn close(&self) -> HandMove {
        self.closing(1.0)
    }

    /// Fingers on their way from open to closed.
    pub fn closing(&self, share: f32) -> HandMove {
        let (open_rad, closed_rad) = (self.open_rad(), mirrored(self.hold.closed_rad, self.side));
        let between = |i: usize| open_rad[i] + (closed_rad[i] - open_rad[i]) * share;
        HandMove::shape(self.robot, self.side, std::array::from_fn(between))
    }

    pub fn open(&self) -> HandMove {
        HandMove::shape(self.robot, self.side, self.open_rad())
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

/// Closes all hands on their places at once; hands that miss try again.
pub fn take_together(commander: &mut Commander, grasps: &[HandGrasp]) -> Result<(), PlayerError> {
    let each = |commander: &mut Commander,
                part: fn(&HandGrasp, &mut Commander) -> Result<HandMove, PlayerError>| {
        grasps.iter().map(|grasp| part(grasp, commander)).collect::<Result<Vec<_>, _>>()
    };
    for _ in 0..ATTEMPTS {
        let before = each(commander, |grasp, commander| grasp.at_stop(commander, 0))?;
        commander.perform(1.4, &before)?;
        let around = each(commander, |grasp, commander| grasp.around(commander))?;
        commander.perform(0.8, &around)?;
        let close: Vec<HandMove> = grasps.iter().map(HandGrasp::close).collect();
        commander.perform(0.8, &close)?;
        commander.perform(0.4, &close)?;
        let mut held = true;
        for grasp in grasps {
            held &= grasp.holds(commander)?;
        }
        if held {
            return Ok(());
        }
        let open: Vec<HandMove> = grasps.iter().map(HandGrasp::open).collect();
        commander.perform(0.5, &open)?;
    }
    Err(PlayerError::GaveUp("not every hand could take hold".into()))
}

/// Brings an object that all `grasps` hold to a pose (world) in `legs` short straight moves, so that hands and object
/// stay together on a path that turns.
pub fn move_together(
    commander: &mut Commander,
    grasps: &[HandGrasp],
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
