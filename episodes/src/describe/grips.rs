//! Example grips for each kind of object in the tasks, as policies receive them. They equal the experts'
//! grips, which a test in this crate compares. In another test a robot performs each grip from this
//! information alone.

use tandem_tools_spec::WorkedGrip;

use crate::tasks::GripKind;

const OPEN_RAD: [f64; 7] = [0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0];
const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Right and left wrist orientations: fingers forward and palms facing each other; fingers forward and
/// palms down; fingers down and palms facing each other.
const AHEAD: [[f64; 4]; 2] = [[1.0, 0.0, 0.0, 0.0]; 2];
const PALMS_DOWN: [[f64; 4]; 2] = [[HALF, -HALF, 0.0, 0.0], [HALF, HALF, 0.0, 0.0]];
const FINGERS_DOWN: [[f64; 4]; 2] = [[HALF, 0.0, HALF, 0.0]; 2];

/// Returns the grips of these kinds, or every one.
pub fn grips(kinds: Option<&[GripKind]>) -> Vec<WorkedGrip> {
    let all = wrapped().into_iter().chain(pinched()).chain(rims());
    all.filter(|(kind, _)| kinds.is_none_or(|kinds| kinds.contains(kind))).map(|(_, grip)| grip).collect()
}

/// Returns the grips that wrap fingers and thumb round an object.
fn wrapped() -> Vec<(GripKind, WorkedGrip)> {
    let beside = vec![[0.0, 0.08, 0.0]];
    vec![
        (
            GripKind::Bottle,
            WorkedGrip {
                stand_behind_m: None,
                ..grip(
                    "upright round things of 7 cm: bottle below its neck, cup",
                    "its axis",
                    AHEAD,
                    [0.12, 0.055, 0.0],
                    beside.clone(),
                    1.0,
                )
            },
        ),
        (
            GripKind::Bar,
            grip(
                "a bar of 36 mm, as a handle, from above",
                "its axis",
                PALMS_DOWN,
                [0.105, 0.042, 0.0],
                beside.clone(),
                1.3,
            ),
        ),
        (
            GripKind::Moulding,
            grip(
                "an upright moulding of 50 by 40 mm, from outside",
                "its axis",
                AHEAD,
                [0.112, 0.045, 0.0],
                beside.clone(),
                1.1,
            ),
        ),
    ]
}

/// Returns the grips that press a plate or a leg with the thumb against palm or fingers.
fn pinched() -> Vec<(GripKind, WorkedGrip)> {
    vec![
        (
            GripKind::PlateEdge,
            WorkedGrip {
                open_rad: [0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0],
                close_rad: [0.0, -0.9, -1.74, 0.3, 0.2, 0.3, 0.2],
                stand_behind_m: Some(0.32),
                ..grip(
                    "the edge of a plate of 30 mm, as of a table: thumb under it (thinner or thicker: y of place_m is 0.017 and the thickness)",
                    "the lower edge; of a round plate 0.24 m apart, both straight ahead",
                    PALMS_DOWN,
                    [0.085, 0.047, 0.0],
                    vec![[0.14, 0.03, 0.0], [0.0, 0.03, 0.0]],
                    1.0,
                )
            },
        ),
        (
            GripKind::Leg,
            WorkedGrip {
                pelvis_height_m: Some(0.64),
                close_rad: [0.0, -0.9, -1.74, 1.0, 1.0, 1.0, 1.0],
                stand_behind_m: Some(0.38),
                ..grip(
                    "an upright leg of 28 mm, from outside, 5 cm under what stands on it",
                    "its axis",
                    AHEAD,
                    [0.1, 0.032, 0.0],
                    vec![[0.0, 0.09, 0.025], [0.0, 0.0, 0.025]],
                    1.0,
                )
            },
        ),
    ]
}

/// Returns the grips that press a rim with the thumb against palm or fingers.
fn rims() -> Vec<(GripKind, WorkedGrip)> {
    vec![
        (
            GripKind::Rim,
            WorkedGrip {
                close_rad: [0.0, -0.95, -0.6, 1.57, 0.6, 1.57, 0.6],
                ..grip(
                    "a rim of 24 mm, from above, fingers inside",
                    "its axis",
                    PALMS_DOWN,
                    [0.095, 0.031, 0.0],
                    vec![[0.0, 0.09, 0.0]],
                    1.0,
                )
            },
        ),
        (
            GripKind::WallRim,
            WorkedGrip {
                close_rad: [0.0, -1.04, -1.74, 0.3, 0.3, 0.3, 0.3],
                stand_behind_m: Some(0.38),
                ..grip(
                    "the rim of an upright wall, as of a tall bin: palm on its outside, thumb over the rim",
                    "the outer edge",
                    FINGERS_DOWN,
                    [0.09, 0.017, 0.0],
                    vec![[0.16, 0.05, 0.0], [0.0, 0.05, 0.0]],
                    1.0,
                )
            },
        ),
    ]
}

/// Returns a grip with fingers wrapped round an object. A `closure` of 1 fits a diameter of 7 cm.
fn grip(
    thing: &str,
    place: &str,
    [right_quaternion_wxyz, left_quaternion_wxyz]: [[f64; 4]; 2],
    place_m: [f64; 3],
    stops_m: Vec<[f64; 3]>,
    closure: f64,
) -> WorkedGrip {
    let coarse = |part: f64| (part * 1000.0).round() / 1000.0 + 0.0;
    WorkedGrip {
        thing: thing.into(),
        place: place.into(),
        right_quaternion_wxyz: right_quaternion_wxyz.map(coarse),
        left_quaternion_wxyz: left_quaternion_wxyz.map(coarse),
        place_m,
        stops_m,
        open_rad: OPEN_RAD,
        close_rad: [0.0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3].map(|angle_rad: f64| coarse(angle_rad * closure)),
        stand_behind_m: Some(0.29),
        pelvis_height_m: None,
    }
}
