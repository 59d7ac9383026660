//! Tests of every grip in the brief, performed with the brief's information and the common tools alone.
//! Only the objects' positions come from the simulator; a policy would measure them.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde_json::json;
use tandem_episodes::{A, B, Facts, Grip as Truth, Session};
use tandem_sim::{Pose, Side};
use tandem_tools_spec::{Call, CommandReply, Grip, Protocol, ToolReply, WorkedGrip};

use crate::common::*;

/// An object to grip in a task: a robot, the places of its hands on the object, and its heading in the
/// object's frame.
pub struct Trial {
    pub thing: &'static str,
    pub task: &'static str,
    pub robot: usize,
    pub object: &'static str,
    pub places: &'static [(Side, &'static str)],
    pub heading_rad: f64,
    /// True if the robot has to walk there.
    pub walks: bool,
}

pub fn isometry(pose: &Pose) -> Isometry3<f64> {
    let (t, r) = (pose.translation, pose.rotation);
    let [w, x, y, z] = [r.w, r.x, r.y, r.z].map(f64::from);
    Isometry3::from_parts(
        Translation3::new(t.x.into(), t.y.into(), t.z.into()),
        UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
    )
}

pub fn heading_rad(pose: &Isometry3<f64>) -> f64 {
    let ahead = pose.rotation * Vector3::x();
    ahead.y.atan2(ahead.x)
}

/// Returns the pose made upright, with the same position and heading.
pub fn upright(pose: &Isometry3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(
        pose.translation,
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading_rad(pose)),
    )
}

impl Trial {
    fn place_m(&self, facts: &Facts, place: &str) -> Vector3<f64> {
        let object = isometry(&facts.object(self.object).pose_in_world);
        (object
            * nalgebra::Point3::from(Vector3::from(
                facts.site(self.object, place).position_m().to_array().map(f64::from),
            )))
        .coords
    }

    fn name(&self) -> &'static str {
        ["A", "B", "C"][self.robot]
    }

    fn ask(&self, session: &mut Session, tool: &str, args: serde_json::Value) -> ToolReply {
        session.ask(None, Call::parse(tool, args).unwrap()).unwrap().reply
    }

    fn walk(&self, session: &mut Session, began: &Isometry3<f64>, grip: &WorkedGrip) {
        let facts = session.facts();
        let object = isometry(&facts.object(self.object).pose_in_world);
        let heading = heading_rad(&object) + self.heading_rad;
        let ahead = Vector3::new(heading.cos(), heading.sin(), 0.0);
        let middle = self.places.iter().map(|(_, place)| self.place_m(&facts, place)).sum::<Vector3<f64>>()
            / self.places.len() as f64;
        for farther_m in [0.35, 0.0] {
            let goal = middle - ahead * (grip.stand_behind_m.unwrap() + farther_m);
            let to_m = upright(began).inverse_transform_vector(&(goal - began.translation.vector));
            let args = json!({ "steps": 1500, "robots": [{
                "robot": self.name(), "to_m": [to_m.x, to_m.y], "heading_rad": heading - heading_rad(began),
            }] });
            let ToolReply::Plan(reply) = self.ask(session, "walk_to", args) else { panic!("no plan") };
            assert_eq!(reply.stopped, None, "{}: {reply:?}", self.thing);
        }
    }

    /// Moves the hands to a distance of `off_m` from their places, and sets their fingers.
    fn move_hands(
        &self,
        session: &mut Session,
        grip: &WorkedGrip,
        off_m: Option<[f64; 3]>,
        fingers_rad: &[f64; 7],
        commands: u32,
    ) -> CommandReply {
        let mut last = None;
        for _ in 0..commands {
            let facts = session.facts();
            let level = upright(&isometry(&facts.robots[self.robot].pelvis_in_world));
            let mut entry = json!({ "robot": self.name(), "frame": "level" });
            for (side, place) in self.places {
                let (quaternion, mirror) = match side {
                    Side::Right => (grip.right_quaternion_wxyz, 1.0),
                    Side::Left => (grip.left_quaternion_wxyz, -1.0),
                };
                let fingers: Vec<f64> = fingers_rad
                    .iter()
                    .enumerate()
                    .map(|(i, rad)| if i == 0 { *rad } else { rad * mirror })
                    .collect();
                entry[format!("{}_fingers_rad", side.name())] = json!(fingers);
                let Some(off_m) = off_m else { continue };
                let [w, x, y, z] = quaternion;
                let turned = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                let at = Vector3::new(
                    grip.place_m[0] + off_m[0],
                    (grip.place_m[1] + off_m[1]) * mirror,
                    grip.place_m[2] + off_m[2],
                );
                let place_m = level.inverse_transform_point(&self.place_m(&facts, place).into());
                let position = place_m.coords - turned * at;
                entry[format!("{}_position_m", side.name())] = json!([position.x, position.y, position.z]);
                entry[format!("{}_quaternion_wxyz", side.name())] = json!(quaternion);
            }
            match self.ask(session, "move_wrists", json!({ "steps": 25, "robots": [entry] })) {
                ToolReply::Act(reply) => last = Some(reply),
                other => panic!("{other:?}"),
            }
        }
        last.unwrap()
    }

    fn hands(&self, session: &Session) -> Vec<Truth> {
        let facts = session.facts();
        self.places.iter().map(|(side, _)| facts.object(self.object).hands[self.robot][*side]).collect()
    }

    /// Returns true if all hands hold the object.
    pub fn holds(&self, session: &Session) -> bool {
        self.hands(session).iter().all(|hand| *hand == Truth::Holding)
    }

    /// Takes the object with the brief's grip, in a new session. Returns the grip and the last reply.
    pub fn take(&self, session: &mut Session) -> (WorkedGrip, CommandReply) {
        let grips = session.briefing().brief.grips;
        let grip = grips
            .iter()
            .find(|grip| grip.thing.contains(self.thing))
            .unwrap_or_else(|| panic!("{}", self.thing));
        let began = isometry(&session.facts().robots[self.robot].pelvis_in_world);
        if self.walks {
            self.walk(session, &began, grip);
        }
        if let Some(height_m) = grip.pelvis_height_m {
            let low = json!({ "steps": 25, "robots": [{
                "robot": self.name(), "vx_m_s": 0, "vy_m_s": 0, "yaw_rate_rad_s": 0, "pelvis_height_m": height_m,
            }] });
            for _ in 0..4 {
                self.ask(session, "walk", low.clone());
            }
        }
        for stop_m in &grip.stops_m {
            self.move_hands(session, grip, Some(*stop_m), &grip.open_rad, 3);
        }
        self.move_hands(session, grip, Some([0.0; 3]), &grip.open_rad, 3);
        self.move_hands(session, grip, None, &grip.close_rad, 2);
        wait(session, 20);
        let told = self.move_hands(session, grip, None, &grip.close_rad, 1);
        (grip.clone(), told)
    }

    fn run(&self) {
        let mut session = start(self.task, 2012, Protocol::Agentic);
        let (grip, told) = self.take(&mut session);
        let grip = &grip;
        let report = &told.robots[0];
        let says: Vec<_> = self
            .places
            .iter()
            .map(|(side, _)| match side {
                Side::Left => report.left.grip,
                Side::Right => report.right.grip,
            })
            .collect();
        assert!(self.holds(&session), "{}: {report:#?}", self.thing);
        assert!(says.iter().all(|grip| *grip == Some(Grip::TwoSided)), "{}: {report:#?}", self.thing);
        self.move_hands(&mut session, grip, None, &grip.open_rad, 2);
        for stop_m in grip.stops_m.iter().rev() {
            self.move_hands(&mut session, grip, Some(*stop_m), &grip.open_rad, 3);
        }
        assert!(self.hands(&session).iter().all(|hand| *hand == Truth::Off), "{} is let go of", self.thing);
        assert!(!session.facts().robots.iter().any(|robot| robot.fallen), "{}", self.thing);
    }
}

const TRIALS: [Trial; 7] = [
    Trial {
        thing: "upright round",
        task: "handover",
        robot: A,
        object: "bottle",
        places: &[(Side::Right, "grip_low")],
        heading_rad: 0.0,
        walks: false,
    },
    Trial {
        thing: "moulding",
        task: "frame_hang",
        robot: A,
        object: "frame",
        places: &[(Side::Left, "left_side")],
        heading_rad: PI / 2.0,
        walks: false,
    },
    Trial {
        thing: "bar of 36 mm",
        task: "cart_service",
        robot: A,
        object: "service_trolley",
        places: &[(Side::Left, "left"), (Side::Right, "right")],
        heading_rad: -PI / 2.0,
        walks: true,
    },
    Trial {
        thing: "edge of a plate",
        task: "table_align",
        robot: A,
        object: "office_table",
        places: &[(Side::Left, "a_left"), (Side::Right, "a_right")],
        heading_rad: 0.0,
        walks: true,
    },
    Trial {
        thing: "leg of 28 mm",
        task: "move_house",
        robot: B,
        object: "console_table",
        places: &[(Side::Left, "b_left"), (Side::Right, "b_right")],
        heading_rad: PI,
        walks: true,
    },
    Trial {
        thing: "rim of 24 mm",
        task: "co_carry",
        robot: A,
        object: "basket",
        places: &[(Side::Left, "a_left"), (Side::Right, "a_right")],
        heading_rad: 0.0,
        walks: true,
    },
    Trial {
        thing: "upright wall",
        task: "trash_collection",
        robot: A,
        object: "bin",
        places: &[(Side::Left, "left"), (Side::Right, "right")],
        heading_rad: -PI / 2.0,
        walks: true,
    },
];

#[test]
fn every_grip_of_the_brief_grips() {
    let failed: Vec<String> = TRIALS
        .iter()
        .filter_map(|trial| {
            let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| trial.run()));
            println!("{}: {}", trial.thing, if done.is_ok() { "holds" } else { "FAILED" });
            done.is_err().then(|| trial.thing.to_owned())
        })
        .collect();
    assert!(failed.is_empty(), "{failed:?}");
    let told = TRIALS.iter().flat_map(|trial| {
        let grips = start(trial.task, 2012, Protocol::Benchmark).briefing().brief.grips;
        grips.into_iter().map(|grip| grip.thing)
    });
    let told: std::collections::BTreeSet<String> = told.collect();
    assert_eq!(told.len(), TRIALS.len(), "every grip is tried: {told:?}");
}
