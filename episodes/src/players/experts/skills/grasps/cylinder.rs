//! Hand shapes, grasps of upright cylinders, and motions of held objects.

use tandem_sim::{Pose, Rotation, Side, Vector};

use crate::players::PlayerError;
use crate::players::experts::skills::commander::{Commander, HandMove};

/// Position of a held cylinder's axis in a right wrist's frame: in front of the palm, between fingers and
/// thumb.
const AXIS_IN_WRIST_M: Vector = Vector::new(0.1195, 0.055, 0.0);
/// Distance from a cylinder at which a hand begins to approach it, palm first.
const STANDOFF_M: f32 = 0.08;

/// Distance ahead of a hand and beside it by which it clears the object that it has given to another.
const OUT_OF_THE_WAY_M: Vector = Vector::new(0.16, 0.04, 0.0);

/// Grasp of an upright cylinder by one hand.
#[derive(Clone, Copy)]
pub struct CylinderGrasp<'a> {
    pub robot: usize,
    pub side: Side,
    pub object: &'a str,
    /// Site on the object's axis where the middle of the palm goes.
    pub grip: &'a str,
    /// Heading of the hand in the world: the direction its fingers point in.
    pub heading_rad: f32,
}

impl CylinderGrasp<'_> {
    /// Returns the wrist motion to the grip of the object, as if the object were upright and raised by
    /// `raise_m`. The hand stops `standoff_m` before the grip.
    fn grip(
        &self,
        commander: &mut Commander,
        raise_m: f32,
        standoff_m: f32,
    ) -> Result<HandMove, PlayerError> {
        let facts = commander.facts()?;
        let height_m = facts.site(self.object, self.grip).position_m().z;
        let axis_m = facts.position_m(self.object) + Vector::new(0.0, 0.0, raise_m);
        let rotation = Rotation::from_rotation_z(self.heading_rad);
        let axis = mirrored_m(AXIS_IN_WRIST_M + Vector::new(0.0, standoff_m, 0.0), self.side);
        let origin_m = axis_m + Vector::new(0.0, 0.0, height_m) - rotation * axis;
        Ok(self.reach(Pose::from_parts(origin_m, rotation)))
    }

    fn reach(&self, world_from_wrist: Pose) -> HandMove {
        HandMove::reach(self.robot, self.side, world_from_wrist)
    }

    /// Returns the motion of the open hand to beside the object, `raise_m` above its grip; others may move
    /// at the same time.
    pub fn beside(&self, commander: &mut Commander, raise_m: f32) -> Result<HandMove, PlayerError> {
        Ok(self.grip(commander, raise_m, STANDOFF_M)?.shaped(open_rad(self.side)))
    }

    /// Returns the motion that brings the palm to the object.
    pub fn around(&self, commander: &mut Commander) -> Result<HandMove, PlayerError> {
        self.grip(commander, 0.0, 0.0)
    }

    pub fn close(&self) -> HandMove {
        HandMove::shape(self.robot, self.side, closed_rad(self.side))
    }

    pub fn open(&self) -> HandMove {
        HandMove::shape(self.robot, self.side, open_rad(self.side))
    }

    /// Returns the motion away from the object, the way the hand came.
    pub fn away(&self, commander: &mut Commander) -> Result<HandMove, PlayerError> {
        back_off(commander, self.robot, self.side, Vector::new(0.0, STANDOFF_M, 0.0))
    }

    /// Returns the motion back towards the robot, which leaves room for the others' motions with the object.
    pub fn out_of_the_way(&self, commander: &mut Commander) -> Result<HandMove, PlayerError> {
        back_off(commander, self.robot, self.side, OUT_OF_THE_WAY_M)
    }

    /// Returns the wrist motion that brings the held object's origin to `object_m` (world), upright.
    pub fn carry(&self, commander: &mut Commander, object_m: Vector) -> Result<HandMove, PlayerError> {
        self.bring(commander, Pose::from_translation(object_m))
    }

    /// Returns the wrist motion that brings the held object to a pose (world). The object's rotation about
    /// its own axis is free.
    pub fn bring(&self, commander: &mut Commander, world_from_object: Pose) -> Result<HandMove, PlayerError> {
        let object = commander.facts()?.object(self.object).pose_in_world;
        let wrist = commander.world_from_wrist(self.robot, self.side)?;
        // The object keeps the rotation about its axis that it had relative to the hand in the grasp.
        let upright = self.upright_rotation(object, wrist);
        let goal = Pose::from_parts(world_from_object.translation, world_from_object.rotation * upright);
        Ok(self.reach(goal * object.inverse() * wrist))
    }

    /// Returns the rotation of the held object for which its axis is upright and the hand points along its
    /// heading.
    fn upright_rotation(&self, object: Pose, wrist: Pose) -> Rotation {
        let held = wrist.rotation.inverse() * object.rotation;
        let level = Rotation::from_rotation_z(self.heading_rad) * held;
        Rotation::from_rotation_arc(level * Vector::Z, Vector::Z) * level
    }

    pub fn holds(&self, commander: &mut Commander) -> Result<bool, PlayerError> {
        Ok(commander.facts()?.holds(self.robot, self.side, self.object))
    }
}

const ATTEMPTS: usize = 4;

/// Takes several objects at once, each with its hand; hands that miss try again.
pub fn pick_up_all(commander: &mut Commander, grasps: &[CylinderGrasp]) -> Result<(), PlayerError> {
    for _ in 0..ATTEMPTS {
        let mut missing = Vec::new();
        for grasp in grasps {
            if !grasp.holds(commander)? {
                missing.push(*grasp);
            }
        }
        if missing.is_empty() {
            return Ok(());
        }
        grasp_once(commander, &missing)?;
    }
    let names: Vec<&str> = grasps.iter().map(|grasp| grasp.object).collect();
    Err(PlayerError::GaveUp(format!("could not grasp {}", names.join(" and "))))
}

/// Makes one attempt: the hands move over the objects, down beside them, around them, and close.
fn grasp_once(commander: &mut Commander, grasps: &[CylinderGrasp]) -> Result<(), PlayerError> {
    let each = |commander: &mut Commander,
                part: fn(&CylinderGrasp, &mut Commander) -> Result<HandMove, PlayerError>| {
        grasps.iter().map(|grasp| part(grasp, commander)).collect::<Result<Vec<_>, _>>()
    };
    let above = each(commander, |grasp, commander| grasp.beside(commander, 0.06))?;
    commander.perform(0.8, &above)?;
    let beside = each(commander, |grasp, commander| grasp.beside(commander, 0.0))?;
    commander.perform(0.6, &beside)?;
    let around = each(commander, |grasp, commander| grasp.around(commander))?;
    commander.perform(0.8, &around)?;
    let close: Vec<HandMove> = grasps.iter().map(CylinderGrasp::close).collect();
    commander.perform(0.8, &close)?;
    commander.perform(0.2, &close)
}

/// Finger angles of a right hand around a 7 cm cylinder; a left hand mirrors them.
const CLOSED_RAD: [f32; 7] = [0.0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3];
/// Finger angles of an open right hand. The thumb is turned away, so that the cylinder passes it.
pub const OPEN_RAD: [f32; 7] = [0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Returns the finger angles of a right hand closed by `closure`, which is 1 for a 7 cm cylinder.
pub const fn wrapped_rad(closure: f32) -> [f32; 7] {
    let mut fingers_rad = CLOSED_RAD;
    let mut i = 0;
    while i < fingers_rad.len() {
        fingers_rad[i] *= closure;
        i += 1;
    }
    fingers_rad
}

pub fn closed_rad(side: Side) -> [f32; 7] {
    mirrored(CLOSED_RAD, side)
}

fn open_rad(side: Side) -> [f32; 7] {
    mirrored(OPEN_RAD, side)
}

/// Mirrors finger angles of a right hand for `side`. Every joint of a left hand turns the other way, except
/// the base of the thumb, which turns about the palm.
pub fn mirrored(right_rad: [f32; 7], side: Side) -> [f32; 7] {
    match side {
        Side::Right => right_rad,
        Side::Left => std::array::from_fn(|i| if i == 0 { right_rad[i] } else { -right_rad[i] }),
    }
}

/// Returns the motion of a hand away from a released object, which is then `off_m` farther off, in a right
/// wrist's frame.
pub fn back_off(
    commander: &mut Commander,
    robot: usize,
    side: Side,
    off_m: Vector,
) -> Result<HandMove, PlayerError> {
    let wrist = commander.world_from_wrist(robot, side)?;
    let back_m = wrist.rotation * mirrored_m(off_m, side);
    Ok(HandMove::reach(robot, side, Pose::from_parts(wrist.translation - back_m, wrist.rotation)))
}

/// Converts a point from a right wrist's frame to the wrist's frame of `side`.
pub fn mirrored_m(right_m: Vector, side: Side) -> Vector {
    Vector::new(right_m.x, right_m.y * away(side), right_m.z)
}

/// Returns the sign of y, in the wrist's frame, on the side that the palm faces: 1 for a right hand.
pub fn away(side: Side) -> f32 {
    -side.sign()
}
