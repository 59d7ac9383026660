//! Sensing of a hand's contacts: from the torques of its own drives, and from the poses of thumb, fingers
//! and palm. The simulator's contacts are not used.

use std::ops::Range;

use tandem_sim::mjcf::{Geom, Primitive};
use tandem_sim::{HAND_JOINTS, Pose, RobotModel, RobotSensed, Side, UPPER, Vector};
use tandem_tools_spec::{Grip, HandPart, Touch};

use crate::commands::columns;

/// Torque thresholds of a finger's drive. Against a contact force of 1.5 N it is about 0.1 N m; in a free
/// finger it is below 0.03 N m.
const PRESSES_N_M: f32 = 0.1;
const TOUCHES_N_M: f32 = 0.05;
/// Lever arm of the thumb's contact. The thumb presses against the palm if the arm senses less than this
/// fraction of the thumb's force.
const THUMB_LEVER_M: f32 = 0.06;
const WITHIN_PART: f32 = 0.5;
/// Joint speed above which a finger works against its own inertia and damping.
const MOVES_RAD_S: f32 = 0.5;
/// Maximum distance at which two shapes count as touching.
const NEAR_M: f32 = 0.004;
/// Joints in the order of `move_wrists`.
const THUMB: Range<usize> = 0..3;
const PARTS: [(HandPart, Range<usize>); 3] =
    [(HandPart::Thumb, THUMB), (HandPart::Middle, 3..5), (HandPart::Index, 5..7)];
/// Index of thumb_0, which swings the thumb to the side, and neither opens nor closes it.
const SWINGING: usize = 0;
/// Number of points along a capsule at which its distance from another shape is computed.
const POINTS: usize = 9;

/// Contacts of a hand, sensed by the torques of its own drives.
pub struct Felt {
    pub grip: Grip,
    /// Parts of the hand that press.
    pub presses: Vec<HandPart>,
    pub touch: Option<Touch>,
}

/// Senses the grip of a hand. A scored hold needs opposite contact forces, but torques do not reveal their
/// directions. A force on the fingertip and twice that force halfway along the finger have the same torque.
pub fn felt(side: Side, sensed: &RobotSensed, model: &RobotModel) -> Felt {
    let closing: [f32; HAND_JOINTS] = std::array::from_fn(|finger| closing_n_m(side, finger, sensed));
    let most = |joints: Range<usize>| closing[joints].iter().copied().fold(0.0, f32::max);
    let pressing =
        |(part, joints): &(HandPart, Range<usize>)| (most(joints.clone()) >= PRESSES_N_M).then_some(*part);
    let thumb_n_m = most(THUMB);
    let [thumb, fingers] =
        [&PARTS[..1], &PARTS[1..]].map(|parts| parts.iter().filter_map(pressing).collect::<Vec<HandPart>>());
    let of_itself = thumb_n_m >= TOUCHES_N_M && thumb_touches_own_hand(side, sensed, model);
    // The palm's reaction is internal to the hand, and does not load the arm.
    let within_n = WITHIN_PART * thumb_n_m / THUMB_LEVER_M;
    let palm_presses = sensed.hand_force_in_pelvis_n[side].length() < within_n;
    let (grip, palm) = match (thumb.is_empty(), fingers.is_empty()) {
        (false, true) if of_itself => (Grip::None, false),
        (false, false) => (Grip::TwoSided, false),
        (false, true) if palm_presses => (Grip::TwoSided, true),
        (false, true) | (true, false) => (Grip::OneSided, false),
        (true, true) if of_itself => (Grip::None, false),
        (true, true) if closing.iter().any(|torque_n_m| torque_n_m.abs() >= TOUCHES_N_M) => {
            (Grip::Touching, false)
        }
        (true, true) => (Grip::None, false),
    };
    let touch = match grip {
        Grip::None => of_itself.then_some(Touch::Itself),
        Grip::Touching | Grip::OneSided | Grip::TwoSided => Some(Touch::Something),
    };
    let presses = match grip {
        Grip::None | Grip::Touching => Vec::new(),
        Grip::OneSided | Grip::TwoSided => {
            thumb.into_iter().chain(fingers).chain(palm.then_some(HandPart::Palm)).collect()
        }
    };
    Felt { grip, presses, touch }
}

/// Returns the torque with which a finger joint's drive closes it. It is 0 for a moving joint, and for
/// the joint that neither opens nor closes.
fn closing_n_m(side: Side, finger: usize, sensed: &RobotSensed) -> f32 {
    let joint = UPPER[columns::hand(side).start + finger];
    if finger == SWINGING || sensed.joints.qd_rad_s[joint].abs() > MOVES_RAD_S {
        return 0.0;
    }
    // Left thumbs and right fingers close in the positive direction.
    let sign = if THUMB.contains(&finger) { side.sign() } else { -side.sign() };
    sign * sensed.joints.torque_n_m[joint]
}

/// Returns true if the last link of the thumb touches the palm or a finger of its own hand.
fn thumb_touches_own_hand(side: Side, sensed: &RobotSensed, model: &RobotModel) -> bool {
    let hand = &model.hands[side];
    let Some(thumb) = hand.thumb.last() else { return false };
    let poses = model.forward_kinematics(Pose::IDENTITY, &sensed.joints.q_rad);
    let geoms = |link: usize| {
        let pose = poses[link];
        model.links[link]
            .geoms
            .iter()
            .filter(|geom| geom.collides)
            .map(move |geom| (pose * geom.body_from_geom, geom))
    };
    let others = || std::iter::once(hand.wrist).chain(hand.fingers.iter().copied()).flat_map(geoms);
    geoms(*thumb).any(|(pose, geom)| {
        let Primitive::Capsule { radius_m, half_length_m } = geom.primitive else { return false };
        let along =
            |i: usize| pose * (Vector::Z * (half_length_m * (2.0 * i as f32 / (POINTS - 1) as f32 - 1.0)));
        others().any(|(other, shape)| {
            (0..POINTS).any(|i| distance_m(along(i), &other, shape) < radius_m + NEAR_M)
        })
    })
}

/// Returns the distance of a point from a shape; infinite for shapes that hands do not have.
fn distance_m(point_m: Vector, pose: &Pose, geom: &Geom) -> f32 {
    let point_m = pose.inverse() * point_m;
    match &geom.primitive {
        Primitive::Box { half_extents_m } => (point_m.abs() - *half_extents_m).max(Vector::ZERO).length(),
        Primitive::Capsule { radius_m, half_length_m } => {
            let nearest_m = Vector::Z * point_m.z.clamp(-*half_length_m, *half_length_m);
            (point_m - nearest_m).length() - *radius_m
        }
        _ => f32::INFINITY,
    }
}
