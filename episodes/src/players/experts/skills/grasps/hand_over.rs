//! Upright cylinders that go from hand to hand: they are picked up, given, put on a place and released.

use tandem_sim::Vector;

use super::cylinder::{CylinderGrasp, pick_up_all};
use crate::players::PlayerError;
use crate::players::experts::skills::commander::Commander;

/// Height above its place from which the object is lowered.
const ABOVE_PLACE_M: Vector = Vector::new(0.0, 0.0, 0.05);
const ATTEMPTS: usize = 4;
const RELEASES: usize = 20;

/// Takes an object that stands on a support, and lifts it straight up until it is held in the air.
pub fn pick_up(commander: &mut Commander, grasp: &CylinderGrasp, lift_m: Vector) -> Result<(), PlayerError> {
    for _ in 0..ATTEMPTS {
        pick_up_all(commander, &[*grasp])?;
        let resting_m = commander.facts()?.position_m(grasp.object);
        let lift = grasp.carry(commander, resting_m + lift_m)?;
        commander.perform(1.0, &[lift])?;
        if grasp.holds(commander)? {
            return Ok(());
        }
        release(commander, grasp)?;
    }
    let robot = commander.task().robots[grasp.robot].name;
    Err(PlayerError::GaveUp(format!("{robot} lost the {}", grasp.object.replace('_', " "))))
}

/// Hands an object over: the taker closes its hand on it while the giver holds it out; then the giver lets
/// go.
pub fn hand_over(
    commander: &mut Commander,
    giver: &CylinderGrasp,
    taker: &CylinderGrasp,
) -> Result<(), PlayerError> {
    for _ in 0..ATTEMPTS {
        let beside = taker.beside(commander, 0.0)?;
        commander.perform(1.2, &[beside])?;
        let around = taker.around(commander)?;
        commander.perform(0.8, &[around])?;
        commander.perform(0.8, &[taker.close()])?;
        commander.perform(0.2, &[taker.close()])?;
        if taker.holds(commander)? {
            return let_go(commander, giver);
        }
        release(commander, taker)?;
    }
    let robot = commander.task().robots[taker.robot].name;
    Err(PlayerError::GaveUp(format!("{robot} could not take the {}", taker.object.replace('_', " "))))
}

/// Opens the hand and withdraws it until it no longer holds the object. A person who controls the hand may
/// take longer.
fn let_go(commander: &mut Commander, giver: &CylinderGrasp) -> Result<(), PlayerError> {
    for _ in 0..RELEASES {
        release(commander, giver)?;
        if !giver.holds(commander)? {
            return Ok(());
        }
    }
    let robot = commander.task().robots[giver.robot].name;
    Err(PlayerError::GaveUp(format!("{robot} does not let go of the {}", giver.object.replace('_', " "))))
}

/// Puts a held object on a place and lets go of it.
pub fn stand_on(
    commander: &mut Commander,
    grasp: &CylinderGrasp,
    place_m: Vector,
) -> Result<(), PlayerError> {
    let over = grasp.carry(commander, place_m + ABOVE_PLACE_M)?;
    commander.perform(1.0, &[over])?;
    let down = grasp.carry(commander, place_m)?;
    commander.perform(0.8, &[down])?;
    release(commander, grasp)?;
    // The object counts as placed only after a moment without touch.
    commander.perform(1.0, &[grasp.open()])
}

/// Opens the hand and takes it away.
pub fn release(commander: &mut Commander, grasp: &CylinderGrasp) -> Result<(), PlayerError> {
    commander.perform(0.5, &[grasp.open()])?;
    let away = grasp.away(commander)?;
    commander.perform(0.6, &[away])
}
