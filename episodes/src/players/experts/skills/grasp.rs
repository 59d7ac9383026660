//! Grasps of upright cylinders, and moving what a hand holds.

use tandem_sim::{Pose, Rotation, Side, Vector};

use super::stage::HandMove;
use super::{ExpertError, Stage};

/// Fingers of a right hand around a 7 cm cylinder; a left hand mirrors them.
const CLOSED_RAD: [f32; 7] = [0.0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3];
/// The thumb stands off, so that the cylinder passes it.
const OPEN_RAD: [f32; 7] = [0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0];
/// Where the axis of a held cylinder lies in a right wrist's frame: in front of the palm, between fingers and thumb.
const AXIS_IN_WRIST_M: Vector = Vector::new(0.1195, 0.055, 0.0);
/// From here a hand comes at a cylinder, palm first.
const STANDOFF_M: f32 = 0.08;

pub fn closed_rad(side: Side) -> [f32; 7] {
    mirrored(CLOSED_RAD, side)
}

pub fn open_rad(side: Side) -> [f32; 7] {
    mirrored(OPEN_RAD, side)
}

/// Every joint of a left hand turns the other way, but for the base of the thumb, which turns about the palm.
fn mirrored(right_rad: [f32; 7], side: Side) -> [f32; 7] {
    match side {
        Side::Right => right_rad,
        Side::Left => std::array::from_fn(|i| if i == 0 { right_rad[i] } else { -right_rad[i] }),
    }
}

/// A hand that is to hold an upright cylinder.
#[derive(Clone, Copy)]
pub struct CylinderGrasp<'a> {
    pub robot: usize,
    pub side: Side,
    pub object: &'a str,
    /// Height of the middle of the palm above the object's origin.
    pub height_m: f32,
    /// Heading of the hand in the world: the direction its fingers point in.
    pub heading_rad: f32,
}

impl CylinderGrasp<'_> {
    /// Wrist pose (world) that has the cylinder's axis through `axis_m` in its grip, `standoff_m` short of it.
    fn wrist(&self, axis_m: Vector, standoff_m: f32) -> Pose {
        let rotation = Rotation::from_rotation_z(self.heading_rad);
        let mirror = if self.side == Side::Left { -1.0 } else { 1.0 };
        let axis = AXIS_IN_WRIST_M + Vector::new(0.0, standoff_m, 0.0);
        let axis = Vector::new(axis.x, axis.y * mirror, axis.z);
        Pose::from_parts(axis_m + Vector::new(0.0, 0.0, self.height_m) - rotation * axis, rotation)
    }

    fn object_m(&self, stage: &mut Stage) -> Result<Vector, ExpertError> {
        Ok(stage.facts()?.position_m(self.object))
    }

    fn reach(&self, world_from_wrist: Pose) -> HandMove {
        HandMove::reach(self.robot, self.side, world_from_wrist)
    }

    /// Open hand beside the object, `raise_m` above its grip; others may move at the same time.
    pub fn beside(&self, stage: &mut Stage, raise_m: f32) -> Result<HandMove, ExpertError> {
        let at_m = self.object_m(stage)? + Vector::new(0.0, 0.0, raise_m);
        Ok(self.reach(self.wrist(at_m, STANDOFF_M)).shaped(open_rad(self.side)))
    }

    /// Palm at the object.
    pub fn around(&self, stage: &mut Stage) -> Result<HandMove, ExpertError> {
        let at_m = self.object_m(stage)?;
        Ok(self.reach(self.wrist(at_m, 0.0)))
    }

    pub fn close(&self) -> HandMove {
        HandMove::shape(self.robot, self.side, closed_rad(self.side))
    }

    pub fn open(&self) -> HandMove {
        HandMove::shape(self.robot, self.side, open_rad(self.side))
    }

    /// Away from the object, the way it came.
    pub fn away(&self, stage: &mut Stage) -> Result<HandMove, ExpertError> {
        let wrist = stage.world_from_wrist(self.robot, self.side)?;
        let mirror = if self.side == Side::Left { -1.0 } else { 1.0 };
        let back = wrist.rotation * Vector::new(0.0, -STANDOFF_M * mirror, 0.0);
        Ok(self.reach(Pose::from_parts(wrist.translation + back, wrist.rotation)))
    }

    /// Wrist motion that brings the held object's origin to `object_m` (world), upright.
    pub fn carry(&self, stage: &mut Stage, object_m: Vector) -> Result<HandMove, ExpertError> {
        self.bring(stage, Pose::from_translation(object_m))
    }

    /// Wrist motion that brings the held object to a pose (world); its turn about its own axis does not matter.
    pub fn bring(&self, stage: &mut Stage, world_from_object: Pose) -> Result<HandMove, ExpertError> {
        let object = stage.facts()?.object(self.object).pose_in_world;
        let wrist = stage.world_from_wrist(self.robot, self.side)?;
        // How the object is turned about its axis relative to the hand stays as it was grasped.
        let upright = self.upright_rotation(object, wrist);
        let goal = Pose::from_parts(world_from_object.translation, world_from_object.rotation * upright);
        Ok(self.reach(goal * object.inverse() * wrist))
    }

    /// The rotation that the held object has when its axis stands upright and the hand points along its heading.
    fn upright_rotation(&self, object: Pose, wrist: Pose) -> Rotation {
        let held = wrist.rotation.inverse() * object.rotation;
        let level = Rotation::from_rotation_z(self.heading_rad) * held;
        Rotation::from_rotation_arc(level * Vector::Z, Vector::Z) * level
    }

    pub fn holds(&self, stage: &mut Stage) -> Result<bool, ExpertError> {
        Ok(stage.facts()?.holds(self.robot, self.side, self.object))
    }
}

const ATTEMPTS: usize = 4;

/// Takes several objects at once, each with its hand; hands that miss try again.
pub fn pick_up_all(stage: &mut Stage, grasps: &[CylinderGrasp]) -> Result<(), ExpertError> {
    for _ in 0..ATTEMPTS {
        let mut missing = Vec::new();
        for grasp in grasps {
            if !grasp.holds(stage)? {
                missing.push(*grasp);
            }
        }
        if missing.is_empty() {
            return Ok(());
        }
        grasp_once(stage, &missing)?;
    }
    let names: Vec<&str> = grasps.iter().map(|grasp| grasp.object).collect();
    Err(ExpertError::GaveUp(format!("could not grasp {}", names.join(" and "))))
}

/// One attempt: over the objects, down beside them, around them, close.
pub fn grasp_once(stage: &mut Stage, grasps: &[CylinderGrasp]) -> Result<(), ExpertError> {
    let each = |stage: &mut Stage, part: fn(&CylinderGrasp, &mut Stage) -> Result<HandMove, ExpertError>| {
        grasps.iter().map(|grasp| part(grasp, stage)).collect::<Result<Vec<_>, _>>()
    };
    let above = each(stage, |grasp, stage| grasp.beside(stage, 0.06))?;
    stage.perform(0.8, &above)?;
    let beside = each(stage, |grasp, stage| grasp.beside(stage, 0.0))?;
    stage.perform(0.6, &beside)?;
    let around = each(stage, |grasp, stage| grasp.around(stage))?;
    stage.perform(0.8, &around)?;
    let close: Vec<HandMove> = grasps.iter().map(CylinderGrasp::close).collect();
    stage.perform(0.8, &close)?;
    stage.perform(0.2, &close)
}
