//! Phases on both sides of every published threshold, in worlds that were changed by hand.

use tandem_episodes::{A, B, Done, EpisodeSpec, Facts, Grip, ObjectFacts, Session, tasks};
use tandem_sim::{Rotation, Side, Vector};
use tandem_tools_spec::Protocol;

use super::table::{self, AtRest};

/// A hair's breadth to either side of a threshold, as a share of it.
const INSIDE: f32 = 0.999;
const OUTSIDE: f32 = 1.001;

/// A task's world before anything has happened.
struct Scene {
    task: &'static tasks::Task,
    start: Facts,
}

impl Scene {
    fn of(id: &str) -> Scene {
        let task = tasks::find(id).unwrap();
        let session = Session::start(&EpisodeSpec::new(task, 0, Protocol::Benchmark), None).unwrap();
        Scene { task, start: session.facts() }
    }

    /// Whether the last condition of phase `p` holds in the world as `change` leaves it.
    fn done(&self, p: usize, change: impl Fn(&mut Facts)) -> bool {
        let mut facts = self.start.clone();
        change(&mut facts);
        match &self.task.phases[p - 1].done {
            Done::When(condition) => condition(&facts),
            Done::Sequence { then, .. } => then(&facts),
            Done::Lasting { condition, at_end, .. } => condition(&facts) && at_end(&facts),
            Done::Milestones(milestones) => milestones.iter().all(|milestone| (milestone.condition)(&facts)),
        }
    }

    /// Phase `p` is done at the good side of `threshold` and not at the other; `large` says that more is better.
    fn threshold(&self, p: usize, threshold: f32, large: bool, change: impl Fn(&mut Facts, f32)) {
        let at = |share: f32| self.done(p, |facts| change(facts, threshold * share));
        let (good, bad) = if large { (OUTSIDE, INSIDE) } else { (INSIDE, OUTSIDE) };
        assert!(at(good), "{} p{p} at {}", self.task.id, threshold * good);
        assert!(!at(bad), "{} p{p} at {}", self.task.id, threshold * bad);
    }

    /// Phase `p` asks for `object` to be let go and at rest; `settle` puts it where it belongs.
    fn rest(&self, p: usize, object: &str, limits: &AtRest, settle: impl Fn(&mut Facts)) {
        let settled = |facts: &mut Facts| {
            settle(facts);
            let object = changed(facts, object);
            (object.velocity_m_s, object.angular_velocity_rad_s) = (Vector::ZERO, Vector::ZERO);
            object.untouched_s = 10.0;
        };
        self.threshold(p, limits.speed_m_s, false, |facts, m_s| {
            settled(facts);
            changed(facts, object).velocity_m_s = Vector::new(m_s, 0.0, 0.0);
        });
        self.threshold(p, limits.turning_rad_s, false, |facts, rad_s| {
            settled(facts);
            changed(facts, object).angular_velocity_rad_s = Vector::new(0.0, 0.0, rad_s);
        });
        self.threshold(p, limits.released_s as f32, true, |facts, since_s| {
            settled(facts);
            changed(facts, object).untouched_s = since_s.into();
        });
    }
}

fn changed<'a>(facts: &'a mut Facts, name: &str) -> &'a mut ObjectFacts {
    facts.objects.iter_mut().find(|object| object.name == name).unwrap()
}

fn hold(facts: &mut Facts, robot: usize, side: Side, object: &str) {
    let object = changed(facts, object);
    object.hands[robot][side] = Grip::Holding;
    object.untouched_s = 0.0;
}

fn raise(facts: &mut Facts, object: &str, by_m: f32) {
    let object = changed(facts, object);
    object.pose_in_world.translation.z = object.rest_height_m + by_m;
}

/// About the object's own origin, over x of the world.
fn tilt(facts: &mut Facts, object: &str, by_deg: f32) {
    changed(facts, object).pose_in_world.rotation = Rotation::from_rotation_x(by_deg.to_radians());
}

#[test]
fn handover() {
    let scene = Scene::of("handover");
    scene.threshold(1, table::HANDOVER_LIFT_M, true, |facts, lift_m| {
        hold(facts, A, Side::Right, "bottle");
        raise(facts, "bottle", lift_m);
    });
    let place = |facts: &mut Facts, beside_m: Vector| {
        let target_m = facts.position_m("target_pad");
        let bottle = changed(facts, "bottle");
        bottle.pose_in_world.translation = target_m + beside_m;
        bottle.pose_in_world.rotation = Rotation::IDENTITY;
        bottle.untouched_s = 10.0;
    };
    for axis in [Vector::X, Vector::NEG_X, Vector::Y, Vector::NEG_Y, Vector::Z] {
        scene.threshold(3, table::HANDOVER_PLACE_M, false, |facts, off_m| place(facts, axis * off_m));
    }
    scene.threshold(3, table::PLACED.tilt_deg, false, |facts, by_deg| {
        place(facts, Vector::ZERO);
        tilt(facts, "bottle", by_deg);
    });
    scene.rest(3, "bottle", &table::PLACED, |facts| place(facts, Vector::ZERO));
}

#[test]
fn pouring() {
    let scene = Scene::of("pouring");
    for (vessel, other) in [("cup", "glass"), ("glass", "cup")] {
        scene.threshold(1, table::POURING_LIFT_M, true, |facts, lift_m| {
            raise(facts, vessel, lift_m);
            raise(facts, other, 0.2);
        });
    }
    scene.threshold(2, table::POURING_TIP_DEG, true, |facts, by_deg| {
        hold(facts, A, Side::Right, "cup");
        raise(facts, "cup", 0.2);
        tilt(facts, "cup", by_deg);
    });
    scene.threshold(3, table::POURING_LIFT_M, true, |facts, lift_m| {
        raise(facts, "glass", lift_m);
        let in_glass_m = facts.point_m("glass", Vector::new(0.0, 0.0, 0.02));
        changed(facts, "marble").pose_in_world.translation = in_glass_m;
    });
    let Done::Lasting { for_s, .. } = scene.task.phases[2].done else { panic!("the marble has to stay") };
    assert_eq!(for_s, table::POURING_INSIDE_S);
}

#[test]
fn frame_hang() {
    let scene = Scene::of("frame_hang");
    let held = |facts: &mut Facts| {
        hold(facts, A, Side::Left, "frame");
        hold(facts, B, Side::Right, "frame");
    };
    assert!(scene.done(1, held));
    scene.threshold(2, table::FRAME_LIFT_M, true, |facts, lift_m| {
        held(facts);
        raise(facts, "frame", lift_m);
    });
    // Its loop round the middle of the peg, turned about it in the plane of the picture.
    let hang = |facts: &mut Facts, turned_deg: f32| {
        let peg_m = (facts.site_m("wall_peg", "root") + facts.site_m("wall_peg", "tip")) * 0.5;
        let rotation = Rotation::from_rotation_y(turned_deg.to_radians());
        let loop_m = facts.site("frame", "loop").position_m();
        let frame = changed(facts, "frame");
        frame.pose_in_world.rotation = rotation;
        frame.pose_in_world.translation = peg_m - rotation * loop_m;
        frame.untouched_s = 10.0;
    };
    scene.threshold(3, table::HUNG.tilt_deg, false, hang);
    scene.rest(3, "frame", &table::HUNG, |facts| hang(facts, 0.0));
}

#[test]
fn co_pouring() {
    let scene = Scene::of("co_pouring");
    let held = |facts: &mut Facts| {
        hold(facts, A, Side::Left, "tub");
        hold(facts, B, Side::Right, "tub");
    };
    scene.threshold(1, table::TUB_LIFT_M, true, |facts, lift_m| {
        held(facts);
        raise(facts, "tub", lift_m);
    });
    scene.threshold(2, table::TUB_TIP_DEG, true, |facts, by_deg| {
        held(facts);
        tilt(facts, "tub", by_deg);
    });
    let pour = |facts: &mut Facts, left: usize| {
        held(facts);
        let in_crate_m = facts.point_m("crate", Vector::new(0.0, 0.0, 0.05));
        let apples = facts.objects.iter_mut().filter(|object| object.name.starts_with("apple"));
        apples.skip(left).for_each(|apple| apple.pose_in_world.translation = in_crate_m);
    };
    assert!(scene.done(3, |facts| pour(facts, 0)));
    assert!(!scene.done(3, |facts| pour(facts, 1)), "an apple is still in the tub");
}
