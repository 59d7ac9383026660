//! Brief for policies: frames, cameras and hands in words. The numbers are those of the embedded robot.

use tandem_sim::render::CameraModel;
use tandem_tools_spec::{Assistance, BaseLimits, Brief, Hints, Wording};

use super::grips::grips;
use crate::tasks::GripKind;

const FRAMES: &str = "Poses of wrists and camera, and points of query_depth, are in the robot's own pelvis \
    frame as it is at that moment: x forward, y left, z up, metres. Quaternions are [w, x, y, z].";

/// Text for our own controller. Controllers from files take no height command, and walk at their own height.
const BENT_KNEES: &str = " A robot walks with bent knees: while it steps its pelvis is 0.62 to 0.68 m high, \
    whatever height is commanded, and rises to that height when it stands. What its hands hold sinks and \
    rises along.";

const PARTNERS: &str = "The pelvis frames of different robots are unrelated. To relate two of them, find the \
    same two points, well apart, with query_depth of both robots: robots at full height stand upright to \
    within a few degrees, so a turn about z and a shift take the points of the one to those of the other. \
    With a lowered pelvis or far-reaching arms a robot leans ahead by 5 to 20 degrees: then turn its \
    points upright first, by the plane of floor or table.";

/// Text for policies whose tools take frames.
const ROOM_FRAME: &str = "The pelvis frames of different robots are unrelated, and lean ahead by 5 to 20 degrees \
    with a lowered pelvis or far-reaching arms. Frame \"room\" is the same for all robots, as far as their \
    odometry is right.";

/// Text for policies whose frames `NAMED_FRAMES` describes.
const ODOMETRY: &str = "pelvis_in_start is the pose of a robot's pelvis in its \"start\" frame by its own \
    IMU and joints. It drifts by up to 1 % of the way walked. Replies to commands tell it of robots that have moved.";

const CAMERA: &str = "The camera is in the head, above the waist: waist joints turn and tilt it, and wrist \
    targets may move the waist, so take camera_in_pelvis from the latest observe. Its axes are x right, y \
    down, z forward; the point (x, y, z) is seen at u = fx x / z + cx, v = fy y / z + cy, with (0, 0) the \
    middle of the top left pixel.";

/// Text for robots with a real camera.
const D435I: &str = " It is an Intel RealSense D435i behind a wider lens. Images have noise, and are blurred and \
    sheared while the robot moves: stand still for a sharp one. By `distortion` in its calibration, things at the \
    edge are seen up to 2 pixels further out; points of query_depth are right nevertheless. Depth errs by 2.5 mm at \
    1 m, by 10 mm at 2 m (one standard deviation, of every pixel for itself, so take the middle of several). There is \
    none nearer than 0.28 m, beyond 10 m, and on what lies behind the left edge of something near: ask for a pixel \
    beside it.";

const HANDS: &str = "A wrist's x axis points along its fingers, and its z axis across them; the right palm \
    faces along its y axis, the left palm against it. All in the wrist's frame, in metres, of a right hand \
    (negate y for a left one): a hand closes on what is at [0.12, 0.055, 0]. The palm reaches from x = \
    0.04 to 0.13, and from z = -0.045 to 0.045, and is 0.04 thick. Straight fingers reach to x = 0.22. The \
    thumb, with its angles at 0, stands off the palm at x = 0.065, to y = 0.115. Arms sag by millimetres: a \
    hand that is sent its measured pose again and again sinks, so to hold it send its last target, or leave \
    its pose out.";

/// Text for policies that receive the hands' sensor readings.
const GRIP: &str = "A hand holds something, as phases ask for, while its thumb presses on one side of it and \
    fingers or palm press on the opposite one, within 60 degrees, each with 1.5 N or more, for 60 ms. grip \
    is what the fingers' own drives feel of that: it says \"two_sided\" where both press, and else presses \
    says what does. Whether on opposite sides is not felt: a thing that only hangs in a bent hand, or a round \
    one at the fingertips, is pressed on neighbouring sides, and not held. If it slips, or a phase is not \
    reached, open, bring the palm nearer, so that the thumb comes round, and close farther. Where it says \
    \"one_sided\", close by 0.2 rad more what presses does not name, mostly the thumb; where it says \
    \"touching\" or \"none\" though the hand is closed, bring the palm nearer first. ";

const GRASPING: &str = "Fingers that are stopped short of their targets press: ask them for 0.3 rad more than \
    a thing leaves them. `grips` has grips that work, of right hands (left ones negate all angles but the \
    first), for a robot that faces the thing squarely. Put the wrist where the place lies at place_m in \
    its frame: position = place - R place_m, R being the quaternion's rotation. Come with open_rad over \
    the stops, at each of which place_m is so much more, then to place_m itself; close to close_rad in 25 \
    to 40 steps, fingers first around a bar, and hold still for 20. A hand that closes on a thing without \
    lying on it drags it, and is dragged: robots that are pulled so step and sink; then let the hand go \
    along (no wrist target, or compliance_n_s_m 250) and lay the palm on. To let go, ask for open_rad and \
    leave over the stops, the way you came; fingers that stay bent hook under a bar.";

/// Text for tasks with a load that robots push, or carry together.
const LOADS: &str = " Stand with the pelvis stand_behind_m behind the places of both hands, and in the middle \
    between them: nearer by, thighs and knees push what stands on legs. Who carries with partners lets the \
    hands give way (compliance_n_s_m 250) from when the thing is lifted, by its legs while it is lifted, \
    too, until it stands at its goal.";

/// Text on carrying for policies that have `walk_to`. The tests `a_robot_pushes_a_trolley_by_one_call` and
/// `two_robots_carry_a_basket_by_one_call` check it.
const CARRYING: &str = " To push, and to carry together: grip, and lift what is to be lifted by 0.09 m \
    with compliance_n_s_m 250; then call walk_to with carry, once, with every robot that holds the load, \
    each with its own place: where it stands now, moved by what the load is to move (with frame \"room\" \
    by the same numbers for all; in start frames a partner who faces you goes to its left where you go to \
    your right). Hands keep their places to the robots and their height; about 300 steps and 270 a metre. \
    As long as several hold it, name each of them in every command, with compliance_n_s_m 250: the hands \
    of one that is not named stay stiff, and lead it away. To set down, bring the wrists down again by \
    steps of 0.03 m with compliance_n_s_m 250 once both stand: a thing has touched when force_n along z \
    rises by 1.5 N or more (get_status with explain tells its height over the floor, lowest_m). Open as \
    you are, with compliance_n_s_m 250 and the wrist poses that get_robot_state tells, until grip is \
    \"none\", and only then leave over the stops: a hand that turns stiff while it holds pulls its robot \
    from where it stands.";

const NAMED_FRAMES: &str = " Tools that take `frame` know \"pelvis\"; \"level\", the same but upright: z \
    against gravity, x the way the robot faces (a robot that crouches or carries leans by up to 0.1 rad, \
    which is 7 cm at arm's length); \"start\", which lies on the floor under where the pelvis was when the \
    episode began, z up, x where the robot faced, and stays in the room while the robot moves; and \"room\", \
    which is A's \"start\" for every robot, so that a place has the same numbers for all of them. Targets \
    that are to be held while a robot is pushed or walks are best given in \"start\" or \"room\". Of a \
    quaternion, q and -q are the same rotation.";

/// Text on how our own controller walks.
const WALKING: &str = "A robot that is told to walk gains way after 0.3 to 0.5 s. Told to stop within 2.5 s, \
    it goes on to where speed times time takes it, to within 2 cm and a tenth of the way. After longer \
    walks it coasts: by 3 cm from 0.1 m/s, 8 cm from 0.2, 12 from 0.3 and 20 from 0.4, and by 0.09 rad \
    from turning at 0.5 rad/s; it stands after about a second. While it steps the pelvis sways by up to 4 \
    cm to each side, twice a second: mean over half a second what you steer by, or have walk_to do it. \
    base.state says \"standing\" (a short reply then has no base), \"stepping\", \"settling\" (told to stop, \
    or the pelvis still rises; comes_to_rest_m says where it will stand) or \"pushed\": it steps because its \
    hands or a partner pull it, drifts and sinks by 10 cm. Then free what pulls: loosen wrist targets, \
    give way with compliance_n_s_m, or walk the way it is pulled. Arms that reach more than 0.35 m ahead make a robot \
    step, too: walk nearer instead, or ask for stand_fast.";

const TEAMWORK: &str = "Each robot has an operator of its own; your tools see and move your robot alone. Time \
    passes only while every operator has a command, or has kept the others waiting for longer than their \
    patience: its robot then holds still, time passes without it (did \"held_silent\"), and its next \
    command is refused once with the steps that it missed. So let your partner speak first before you wait \
    long. The shortest command ends the step: a longer one stops with stop_reason \"partner_done\", so \
    repeat it. `partners` in a reply says what the others' robots did. When your part is done call finish: \
    your robot then holds still, and the others play on.";

const TALKING: &str = " `say` reaches the others with their next reply, where `heard` has it. The operator of the \
    first robot, A, proposes who does what, places, heights and a few words, for example IN PLACE, HOLDING, FREE; \
    the others answer or correct. Use the words when they are true; give places in a frame that you share";

/// Text for policies that have plans.
const WAITING: &str = " To wait for a partner, send a plan of one `wait` of up to 1500 steps with `until` \
    and a condition, for example {\"heard\": true}, {\"touching\": true}, {\"force_above_n\": 5} or \
    {\"phase_reached\": \"p1\"}, or {\"any_of\": [...]} with several of which one suffices: it is answered once, \
    and the partner's commands go on meanwhile. {\"partners_wait\": true} holds once every other operator \
    waits, too: end a plan with it to begin the next step together, without a word. To carry \
    one thing with an operator for each robot, go by chunks that both begin together: a plan of four \
    move_wrists of 25 steps with the base velocity and, in frame \"start\", the hands going along as far, \
    compliance_n_s_m and side_compliance_n_s_m 250, then a wait of 25, and one until partners_wait. A walk_to \
    with carry pulls a partner who does not walk.";

/// Returns the part of an operator's brief about partners; `may_talk` is true if they may exchange messages.
pub fn teamwork(assistance: Assistance, may_talk: bool) -> String {
    let waiting = if assistance == Assistance::Full { WAITING } else { "" };
    // Robots without messages never receive a text.
    let waiting = if may_talk { waiting.into() } else { waiting.replace("{\"heard\": true}, ", "") };
    let sharing = if assistance == Assistance::Full { ": best in frame \"room\"." } else { "." };
    let talking = if may_talk { [TALKING, sharing].concat() } else { String::new() };
    [TEAMWORK, &talking, &waiting].concat()
}

/// Returns the brief of an episode in its wording, for robots that follow base commands within `limits`.
/// The cameras are of model `camera`.
pub fn brief(
    wording: Wording,
    limits: &BaseLimits,
    camera: CameraModel,
    kinds: Option<&[GripKind]>,
) -> Brief {
    let Wording { assistance, hints, .. } = wording;
    let is_full = assistance == Assistance::Full;
    let is_hinted = hints == Hints::On;
    let squats = limits.pelvis_height_m.min < limits.pelvis_height_m.max;
    // A task with grips for small things alone has no load.
    let has_loads = kinds.is_none_or(|kinds| kinds.iter().any(|kind| *kind != GripKind::Bottle));
    let carrying = match (has_loads, is_full) {
        (true, true) => [LOADS, CARRYING].concat(),
        (true, false) => LOADS.into(),
        (false, _) => String::new(),
    };
    Brief {
        frames: [FRAMES, if squats { BENT_KNEES } else { "" }, if is_full { NAMED_FRAMES } else { "" }]
            .concat(),
        partners: if is_full { ROOM_FRAME } else { PARTNERS }.into(),
        teamwork: None,
        odometry: is_full.then(|| ODOMETRY.into()),
        camera: match camera {
            CameraModel::Ideal => CAMERA.into(),
            CameraModel::D435i => [CAMERA, D435I].concat(),
        },
        hands: HANDS.into(),
        walking: (is_full && squats).then(|| WALKING.into()),
        grasping: is_hinted.then(|| [if is_full { GRIP } else { "" }, GRASPING, &carrying].concat()),
        grips: if is_hinted { grips(kinds) } else { Vec::new() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tandem_sim::body::BodyScale;
    use tandem_sim::mjcf::{Geom, Primitive};
    use tandem_sim::{JOINTS, LocomotionChoice, Pose, RobotModel, Side, Sides, Vector, assets};

    use crate::convert::wire_limits;

    fn limits() -> BaseLimits {
        wire_limits(&LocomotionChoice::Balance.limits(&BodyScale::G1))
    }

    /// Returns points of a shape in the frame of its link, and the distance by which the shape extends
    /// beyond them.
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

    /// Returns the minimum and maximum corner of these links of a hand in the wrist's frame, with every
    /// finger joint at 0.
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
        let brief = |hints: Hints| super::brief(hints.into(), &limits(), CameraModel::Ideal, None);
        let (with, without) = (brief(Hints::On), brief(Hints::Off));
        assert!(with.grasping.is_some());
        assert!(!with.grips.is_empty());
        assert_eq!(without, Brief { grasping: None, grips: Vec::new(), ..with });
    }

    #[test]
    fn carrying_is_for_tasks_with_a_load() {
        let speaks = |kinds: Option<&[GripKind]>, assistance: Assistance| {
            let brief = super::brief(assistance.into(), &limits(), CameraModel::Ideal, kinds);
            brief.grasping.is_some_and(|text| text.contains("To push, and to carry together"))
        };
        assert!(speaks(None, Assistance::Full));
        assert!(speaks(Some(&[GripKind::Bottle, GripKind::Bar]), Assistance::Full));
        assert!(!speaks(Some(&[GripKind::Bottle]), Assistance::Full));
        assert!(!speaks(None, Assistance::Paper));
    }

    #[test]
    fn bent_knees_are_those_of_our_own_controller() {
        let mut limits = limits();
        let frames =
            |limits: &BaseLimits| brief(Assistance::Paper.into(), limits, CameraModel::Ideal, None).frames;
        assert!(frames(&limits).contains("0.62 to 0.68 m"));
        // The limits of a policy from a file.
        limits.pelvis_height_m.min = limits.pelvis_height_m.max;
        assert!(!frames(&limits).contains("0.62"));
    }

    #[test]
    fn nothing_is_said_of_what_is_not_told() {
        let brief = serde_json::json!(brief(Assistance::Paper.into(), &limits(), CameraModel::Ideal, None))
            .to_string();
        for word in ["pelvis_in_start", "base_motion", "grasping", "odometry", "walking", "level", "grip"] {
            assert!(!brief.contains(word), "{word}: {brief}");
        }
    }
}
