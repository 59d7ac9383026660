//! What a policy has to know of frames, cameras and hands, in words. The numbers are those of the embedded robot.

use tandem_tools_spec::{Assistance, BaseLimits, Brief, Hints, Wording};

const FRAMES: &str = "Poses of wrists and camera, and points of query_depth, are in the robot's own pelvis frame as it is at that \
    moment: x forward, y left, z up, metres. Quaternions are [w, x, y, z].";

/// Of our own controller. Those of files have no height to command, and walk as high as they stand.
const BENT_KNEES: &str = " A robot walks with bent knees: while it steps its pelvis is 0.62 to 0.68 m high, whatever height is \
    commanded, and rises to that height when it stands. What its hands hold sinks and rises along.";

const PARTNERS: &str = "The pelvis frames of different robots are unrelated. To relate two of them, find the same two points, well \
    apart, with query_depth of both robots: robots stand upright, so a turn about z and a shift take the points of the one to \
    those of the other.";

const PARTNERS_MOVE: &str = " pelvis_in_start keeps that valid while robots move.";

const ODOMETRY: &str = "pelvis_in_start is where a robot's own IMU and joints have it: the pose of its pelvis in a frame that lies on \
    the floor under where the pelvis was when the episode began, z up, x where the robot faced. It drifts by up to 1 % of the way \
    walked. base_motion is the same over one command.";

const CAMERA: &str = "The camera is in the head, above the waist: waist joints turn and tilt it, and wrist targets may move the \
    waist, so take camera_in_pelvis from the latest observe. Its axes are x right, y down, z forward; the point (x, y, z) is seen at \
    u = fx x / z + cx, v = fy y / z + cy, with (0, 0) the middle of the top left pixel.";

const HANDS: &str = "A wrist's x axis points along its fingers, and its z axis across them; the right palm faces along its y axis, \
    the left palm against it. All in the wrist's frame, in metres, of a right hand (negate y for a left one): a hand closes on what \
    is at [0.12, 0.055, 0]. The palm reaches from x = 0.04 to 0.13, and from z = -0.045 to 0.045, and is 0.04 thick. Straight \
    fingers reach to x = 0.22. The thumb, with its angles at 0, stands off the palm at x = 0.065, to y = 0.115.";

const GRASPING: &str = "Fingers are given for a right hand, thumb [0, 1, 2] and each finger [0, 1]; a left one has the other sign but for \
    thumb_0. A thumb that is stopped short of its target presses, and fingers that are blocked hold something. Around something \
    upright: open the thumb, come palm first, then close fingers and thumb. Around a bar: lay the palm on it, then close the outer \
    finger joints (middle_1, index_1) first, the inner ones (middle_0, index_0) next and the thumb last; open in the reverse order, \
    since open fingers may stay hooked under it. The edge of a table: palms down (right wrist [0.707, -0.707, 0, 0], left [0.707, \
    0.707, 0, 0]), fingers ahead over the top, thumb under it. The wrist ends 0.085 m before the edge and 0.017 m above the top; come \
    from 0.14 m farther off and 0.03 m higher with the thumb at [0, 0.5, 0], in and then down, and close thumb [0, -0.9, -1.74] and \
    fingers [0.3, 0.2]. A rim from above: palms down, wrist 0.095 m before its middle and 0.031 m above it, fingers inside [1.57, 0.6], \
    thumb outside [0, -0.95, -0.6]. An upright wall, as of a tall bin: both hands point down outside it ([0.707, 0, 0.707, 0]), palms \
    flat on it, wrist 0.09 m above the rim and 0.017 m beside, thumb over the rim [0, -1.04, -1.74], fingers [0.3, 0.3]; come from \
    above, 0.05 m beside. The legs of a table: both hands point ahead ([1, 0, 0, 0]), palms on the outer sides of the legs, 0.05 m under \
    the top; the wrist ends 0.1 m before the middle of the leg and 0.032 m beside it; come from 0.09 m farther out and 0.025 m lower, in \
    and then up, and close thumb [0, -0.9, -1.74] and fingers [1, 1]. Stand with the pelvis 0.3 m behind the places of both hands, 0.38 \
    m behind those on legs or on a bin, which thighs and knees push otherwise, and in the middle between them. Who carries \
    with partners lets the hands give way (compliance_n_s_m 250) from when the thing is lifted, by its legs while it is lifted, too, \
    until it is over its goal; stiff hands lower it. To let go, open, and leave the way you came.";

/// The brief of an episode in the words that its policy reads, where robots follow base commands within `limits`.
pub fn brief(wording: Wording, limits: &BaseLimits) -> Brief {
    let Wording { assistance, hints } = wording;
    let is_full = assistance == Assistance::Full;
    let squats = limits.pelvis_height_m.min < limits.pelvis_height_m.max;
    Brief {
        frames: [FRAMES, if squats { BENT_KNEES } else { "" }].concat(),
        partners: [PARTNERS, if is_full { PARTNERS_MOVE } else { "" }].concat(),
        odometry: is_full.then(|| ODOMETRY.into()),
        camera: CAMERA.into(),
        hands: HANDS.into(),
        grasping: (hints == Hints::On).then(|| GRASPING.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tandem_sim::mjcf::{Geom, Primitive};
    use tandem_sim::{JOINTS, LocomotionChoice, Pose, RobotModel, Side, Sides, Vector, assets};

    use crate::convert::wire_limits;

    fn limits() -> BaseLimits {
        wire_limits(&LocomotionChoice::Balance.limits())
    }

    /// Points of a shape, in the frame of its link, and how far it reaches beyond each of them.
    fn points_m(geom: &Geom) -> (Vec<Vector>, f32) {
        let (points_m, beyond_m) = match &geom.primitive {
            Primitive::Box { half_extents_m } => (vec![-*half_extents_m, *half_extents_m], 0.0),
            Primitive::Capsule { radius_m, half_length_m } => {
                (vec![Vector::Z * *half_length_m, Vector::Z * -*half_length_m], *radius_m)
            }
            other => panic!("a hand is made of boxes and capsules, not of {other:?}"),
        };
        (points_m.into_iter().map(|point_m| geom.body_from_geom * point_m).collect(), beyond_m)
    }

    /// Lowest and highest corner of what these links of a hand span in the wrist's frame, every finger joint at 0.
    fn extent_m(model: &RobotModel, side: Side, links: &[usize]) -> [Vector; 2] {
        let wrist = &model.wrists[side];
        let poses = model.forward_kinematics(Pose::IDENTITY, &[0.0; JOINTS]);
        let wrist_from_pelvis = (poses[wrist.link] * wrist.link_from_site).inverse();
        let (mut low_m, mut high_m) = (Vector::INFINITY, Vector::NEG_INFINITY);
        for link in links {
            for geom in model.links[*link].geoms.iter().filter(|geom| geom.collides) {
                let (points_m, beyond_m) = points_m(geom);
                for point_m in points_m {
                    let point_m = wrist_from_pelvis * poses[*link] * point_m;
                    low_m = low_m.min(point_m - beyond_m);
                    high_m = high_m.max(point_m + beyond_m);
                }
            }
        }
        [low_m, high_m]
    }

    #[test]
    fn hands_are_as_large_as_the_brief_says() {
        let mjcf = assets::robot(assets::DEFAULT_ROBOT).unwrap();
        let model = RobotModel::parse(assets::DEFAULT_ROBOT, mjcf).unwrap();
        let check = |what: &str, found_m: f32, told_m: f32| {
            assert!((found_m - told_m).abs() < 0.006, "{what}: {found_m} m, told {told_m} m");
        };
        let Sides { left, right } = &model.hands;
        for (side, hand, towards) in [(Side::Left, left, -1.0), (Side::Right, right, 1.0)] {
            let [low_m, high_m] = extent_m(&model, side, &[hand.wrist]);
            check("palm begins", low_m.x, 0.04);
            check("palm ends", high_m.x, 0.13);
            check("palm is wide", high_m.z, 0.045);
            check("palm is thick", high_m.y - low_m.y, 0.04);
            check("fingers reach", extent_m(&model, side, &hand.fingers)[1].x, 0.22);
            let thumb_m = extent_m(&model, side, &hand.thumb);
            check(
                "thumb stands off",
                thumb_m.map(|corner_m| corner_m.y * towards).into_iter().fold(0.0, f32::max),
                0.115,
            );
            check("thumb is along", 0.5 * (thumb_m[0].x + thumb_m[1].x), 0.065);
        }
    }

    #[test]
    fn without_hints_there_is_geometry_only() {
        let (with, without) = (brief(Hints::On.into(), &limits()), brief(Hints::Off.into(), &limits()));
        assert!(with.grasping.is_some());
        assert_eq!(without, Brief { grasping: None, ..with });
    }

    #[test]
    fn bent_knees_are_those_of_our_own_controller() {
        let mut limits = limits();
        let frames = |limits: &BaseLimits| brief(Assistance::Paper.into(), limits).frames;
        assert!(frames(&limits).contains("0.62 to 0.68 m"));
        // As of a policy in a file.
        limits.pelvis_height_m.min = limits.pelvis_height_m.max;
        assert!(!frames(&limits).contains("0.62"));
    }

    #[test]
    fn nothing_is_said_of_what_is_not_told() {
        let brief = serde_json::json!(brief(Assistance::Paper.into(), &limits())).to_string();
        for word in ["pelvis_in_start", "base_motion", "grasping", "odometry"] {
            assert!(!brief.contains(word), "{word}: {brief}");
        }
    }
}
