//! Grasps of places on an object by a [`Hold`]. Everything that the places belong to moves as one.

use tandem_sim::{Pose, Rotation, Side, Vector};

use super::cylinder::{back_off, mirrored, mirrored_m};
use super::hold::Hold;
use crate::players::PlayerError;
use crate::players::experts::skills::commander::{Commander, HandMove};
use crate::scoring::Facts;

/// Grasp of a place on an object by one hand.
#[derive(Clone, Copy)]
pub struct HandGrasp<'a> {
    pub robot: usize,
    pub side: Side,
    pub object: &'a str,
    /// Site of the object.
    pub place: &'a str,
    pub hold: Hold,
    /// The robot's heading in the object's frame.
    pub heading_rad: f32,
}

impl<'a> HandGrasp<'a> {
    /// Returns the grasps of both hands of a robot, each on its place, left first. `heading_rad` is the
    /// robot's heading in the object's frame.
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
    /// Returns the wrist's rotation in the object's frame.
    fn object_from_wrist(&self) -> Rotation {
        let [yaw_rad, pitch_rad, roll_rad] = self.hold.turned_rad;
        Rotation::from_rotation_z(self.heading_rad - self.side.sign() * yaw_rad)
            * Rotation::from_rotation_y(pitch_rad)
            * Rotation::from_rotation_x(-self.side.sign() * roll_rad)
    }

    /// Returns the wrist motion to where the place is `off_m` farther off than when it is held, in a right
    /// wrist's frame.
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

    /// Returns the motion of the open hand to a stop on its way in.
    pub fn at_stop(&self, commander: &mut Commander, stop: usize) -> Result<HandMove, PlayerError> {
        Ok(self.reach(commander, self.hold.stops_m[stop])?.shaped(self.open_rad()))
    }

    /// Returns the motion to where the hand closes.
    pub fn around(&self, commander: &mut Commander) -> Result<HandMove, PlayerError> {
        self.reach(commander, Vector::ZERO)
    }

    /// Returns the motion away from a released object, which is then `off_m` farther off, in a right
    /// wrist's frame.
    pub fn off(&self, commander: &mut Commander, off_m: Vector) -> Result<HandMove, PlayerError> {
        back_off(commander, self.robot, self.side, off_m)
    }

    fn open_rad(&self) -> [f32; 7] {
        mirrored(self.hold.open_rad, self.side)
    }

    pub fn close(&self) -> HandMove {
        self.closing(1.0)
    }

    /// Returns the fingers' shape at `share` of the way from open to closed.
    pub fn closing(&self, share: f32) -> HandMove {
        let (open_rad, closed_rad) = (self.open_rad(), mirrored(self.hold.closed_rad, self.side));
        let between = |i: usize| open_rad[i] + (closed_rad[i] - open_rad[i]) * share;
        HandMove::shape(self.robot, self.side, std::array::from_fn(between))
    }

    pub fn open(&self) -> HandMove {
        HandMove::shape(self.robot, self.side, self.open_rad())
    }

    /// Returns `true` if this hand itself holds its object.
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

/// Brings an object that all `grasps` hold along `path` in `legs` short straight moves. Short moves keep
/// hands and object together on a path that turns.
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
