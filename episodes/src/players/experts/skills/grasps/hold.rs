//! Holds as data: the hand's rotation, the position of the place in the hand, the closure of the fingers, the
//! stops, and the robot's distance. They are given for right hands; left hands mirror them.

use std::f32::consts::FRAC_PI_2;

use tandem_sim::Vector;

use super::cylinder::{OPEN_RAD, wrapped_rad};

/// Hold of a place on an object by a right hand.
#[derive(Clone, Copy)]
pub struct Hold {
    /// Rotation of the wrist relative to the robot's heading: about z, then about the wrist's y, then about
    /// its x.
    pub turned_rad: [f32; 3],
    /// Position of the place in the wrist's frame while the hand holds it.
    pub place_in_wrist_m: Vector,
    /// Finger angles in the order of `move_wrists`.
    pub open_rad: [f32; 7],
    pub closed_rad: [f32; 7],
    /// Stops of the hand on its way in, the farthest first: additional offsets of the place in the wrist's
    /// frame. The hand leaves by the same stops.
    pub stops_m: &'static [Vector],
    /// Distance of the robot behind the places of its hands.
    pub behind_m: f32,
}

impl Hold {
    /// A bar 36 mm thick along the wrist's z axis; the place is the bar's axis. The palm is on the bar, with
    /// fingers and thumb round it.
    pub const BAR: Hold = Hold {
        turned_rad: [0.0, 0.0, -FRAC_PI_2],
        place_in_wrist_m: Vector::new(0.105, 0.042, 0.0),
        open_rad: OPEN_RAD,
        // Closed farther than around a bottle: a bar is thinner, and the thumb has to oppose the fingers.
        closed_rad: wrapped_rad(1.3),
        stops_m: &[Vector::new(0.0, 0.08, 0.0)],
        behind_m: 0.29,
    };

    /// The edge of a plate 30 mm thick; the place is the lower edge. Palm and fingers are on the plate, and
    /// the thumb reaches round its edge from below. The hand comes from outside, above the plate, and then
    /// moves down. For other plates, y is 17 mm plus their thickness.
    pub const EDGE: Hold = Hold {
        turned_rad: [0.0, 0.0, -FRAC_PI_2],
        place_in_wrist_m: Vector::new(0.085, 0.047, 0.0),
        // The thumb's last joint is commanded to its stop, and the middle one beyond the range that the plate
        // allows, which makes it press.
        open_rad: [0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0],
        closed_rad: [0.0, -0.9, -1.74, 0.3, 0.2, 0.3, 0.2],
        stops_m: &[Vector::new(0.14, 0.03, 0.0), Vector::new(0.0, 0.03, 0.0)],
        behind_m: 0.32,
    };

    /// The edge of a round plate 0.8 m wide and 30 mm thick: [`Hold::EDGE`] with the hands turned to the
    /// plate's middle.
    pub const ROUND_EDGE: Hold = Hold { turned_rad: [0.15, 0.0, -FRAC_PI_2], behind_m: 0.29, ..Hold::EDGE };

    /// An upright square leg 28 mm wide; the place is the leg's axis. The palm is on its outer side, with
    /// thumb and fingers round it. The hand comes and leaves a little lower, because the object on the leg
    /// rests on the hand.
    pub const LEG: Hold = Hold {
        turned_rad: [0.0, 0.0, 0.0],
        place_in_wrist_m: Vector::new(0.100, 0.032, 0.0),
        open_rad: OPEN_RAD,
        closed_rad: [0.0, -0.9, -1.74, 1.0, 1.0, 1.0, 1.0],
        stops_m: &[Vector::new(0.0, 0.09, 0.025), Vector::new(0.0, 0.0, 0.025)],
        // At a smaller distance, the thighs of robots that sway while they walk press on the legs.
        behind_m: 0.38,
    };

    /// A rim 24 mm thick, grasped from above; the place is the rim's axis. The palm is on it, with the
    /// fingers inside and the thumb outside.
    pub const RIM: Hold = Hold {
        turned_rad: [0.0, 0.0, -FRAC_PI_2],
        place_in_wrist_m: Vector::new(0.095, 0.031, 0.0),
        open_rad: OPEN_RAD,
        closed_rad: [0.0, -0.95, -0.6, 1.57, 0.6, 1.57, 0.6],
        stops_m: &[Vector::new(0.0, 0.09, 0.0)],
        behind_m: 0.29,
    };

    /// The rim of an upright wall; the place is the outer edge. The hand points down with its palm on the
    /// outside, the thumb over the rim. The hand comes from above, beside the wall.
    pub const WALL: Hold = Hold {
        turned_rad: [0.0, FRAC_PI_2, 0.0],
        place_in_wrist_m: Vector::new(0.090, 0.017, 0.0),
        open_rad: OPEN_RAD,
        closed_rad: [0.0, -1.04, -1.74, 0.3, 0.3, 0.3, 0.3],
        stops_m: &[Vector::new(0.16, 0.05, 0.0), Vector::new(0.0, 0.05, 0.0)],
        behind_m: 0.38,
    };
}

#[cfg(test)]
mod tests {
    use tandem_sim::{Rotation, Side};
    use tandem_tools_spec::WorkedGrip;

    use super::*;
    use crate::describe::grips;

    /// Returns the hand's rotation in the level frame of a robot that faces the object.
    fn turned(hold: &Hold, side: Side) -> Rotation {
        let [yaw_rad, pitch_rad, roll_rad] = hold.turned_rad;
        Rotation::from_rotation_z(-side.sign() * yaw_rad)
            * Rotation::from_rotation_y(pitch_rad)
            * Rotation::from_rotation_x(-side.sign() * roll_rad)
    }

    #[test]
    fn policies_are_told_what_experts_do() {
        let moulding = Hold {
            turned_rad: [0.0; 3],
            place_in_wrist_m: Vector::new(0.112, 0.045, 0.0),
            closed_rad: wrapped_rad(1.1),
            ..Hold::BAR
        };
        let holds = [Hold::BAR, moulding, Hold::EDGE, Hold::LEG, Hold::RIM, Hold::WALL];
        let told = grips(None);
        assert_eq!(told.len(), holds.len() + 1, "and one of upright round things");
        for (hold, told) in holds.iter().zip(&told[1..]) {
            let near = |what: &str, told: &[f64], is: &[f32]| {
                let off =
                    told.iter().zip(is).map(|(told, is)| (told - f64::from(*is)).abs()).fold(0.0, f64::max);
                assert!(told.len() == is.len() && off < 0.002, "{what}: told {told:?}, and it is {is:?}");
            };
            let WorkedGrip { thing, place_m, stops_m, open_rad, close_rad, stand_behind_m, .. } = told;
            near(thing, place_m, &hold.place_in_wrist_m.to_array());
            for (told_m, stop_m) in stops_m.iter().zip(hold.stops_m) {
                near(thing, told_m, &stop_m.to_array());
            }
            assert_eq!(stops_m.len(), hold.stops_m.len(), "{thing}");
            near(thing, open_rad, &hold.open_rad);
            near(thing, close_rad, &hold.closed_rad);
            near(thing, &[stand_behind_m.unwrap()], &[hold.behind_m]);
            for (told, side) in
                [(told.right_quaternion_wxyz, Side::Right), (told.left_quaternion_wxyz, Side::Left)]
            {
                let [w, x, y, z] = told.map(|part| part as f32);
                let angle_rad = Rotation::from_xyzw(x, y, z, w).normalize().angle_between(turned(hold, side));
                assert!(angle_rad < 0.005, "{thing}: {side:?} is {angle_rad} rad off");
            }
        }
    }
}
