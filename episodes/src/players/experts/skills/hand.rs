//! Shapes of a hand, and what mirrors between right and left.

use tandem_sim::{Side, Vector};

/// Fingers of a right hand around a 7 cm cylinder; a left hand mirrors them.
const CLOSED_RAD: [f32; 7] = [0.0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3];
/// The thumb stands off, so that the cylinder passes it.
const OPEN_RAD: [f32; 7] = [0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0];

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

/// A point given in a right wrist's frame, in the wrist's frame of `side`.
pub fn mirrored_m(right_m: Vector, side: Side) -> Vector {
    Vector::new(right_m.x, right_m.y * away(side), right_m.z)
}

/// Of y in the wrist's frame on the side that the palm faces: 1 for a right hand.
pub fn away(side: Side) -> f32 {
    -side.sign()
}
