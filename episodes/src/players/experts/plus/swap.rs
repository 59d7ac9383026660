//! The Swap expert: the boxes go over the shelf one after the other. The holder of a box puts it on the shelf
//! with its right hand and withdraws the hand. The partner takes it from there with the left hand and puts it
//! on the pad.

use std::f32::consts::PI;

use tandem_sim::{Side, Vector};

use crate::players::PlayerError;
use crate::players::experts::skills::{Commander, CylinderGrasp, pick_up, stand_on};
use crate::scoring::{A, B};

/// Each box, and the robot that has it at first.
const BOXES: [(&str, usize); 2] = [("blue", A), ("orange", B)];
const LIFT_M: Vector = Vector::new(0.0, 0.0, 0.08);

pub fn perform(commander: &mut Commander) -> Result<(), PlayerError> {
    let first = commander.task().chosen("first").unwrap_or_default();
    let mut boxes = BOXES;
    boxes.sort_by_key(|(colour, _)| *colour != first);
    for (colour, from) in boxes {
        let to = if from == A { B } else { A };
        let own = [format!("{colour}_box"), format!("{colour}_pad")];
        move_over(commander, &hand(from, Side::Right, &own[0]), "shelf_mark")?;
        move_over(commander, &hand(to, Side::Left, &own[0]), &own[1])?;
    }
    Ok(())
}

fn hand(robot: usize, side: Side, object: &str) -> CylinderGrasp<'_> {
    let heading_rad = if robot == A { 0.0 } else { PI };
    CylinderGrasp { robot, side, object, grip: "grip", heading_rad }
}

/// Takes a box, puts it on a mark, and takes the hand out of the partner's way.
fn move_over(commander: &mut Commander, grasp: &CylinderGrasp, mark: &str) -> Result<(), PlayerError> {
    pick_up(commander, grasp, LIFT_M)?;
    let mark_m = commander.facts()?.position_m(mark);
    stand_on(commander, grasp, mark_m)?;
    let back = grasp.out_of_the_way(commander)?;
    commander.perform(0.8, &[back])
}
