//! A modifiable world of a task, with checks of its phases.

use tandem_episodes::{Done, EpisodeSpec, Facts, Grip, ObjectFacts, Session, tasks};
use tandem_sim::{Pose, Rotation, Side, Vector};
use tandem_tools_spec::Protocol;

use super::table::AtRest;

/// Factor just inside a threshold; `OUTSIDE` is just outside.
const INSIDE: f32 = 0.999;
const OUTSIDE: f32 = 1.001;

/// A task's world at its start.
pub struct Scene {
    pub task: tasks::Task,
    start: Facts,
}

impl Scene {
    pub fn of(id: &str) -> Scene {
        let task = tasks::find(id).unwrap();
        let session = Session::start(&EpisodeSpec::new(&task, 0, Protocol::Benchmark), None).unwrap();
        Scene { task, start: session.facts() }
    }

    /// Returns true if the last condition of phase `p` holds in the world modified by `change`.
    pub fn done(&self, p: usize, change: impl Fn(&mut Facts)) -> bool {
        let mut facts = self.start.clone();
        change(&mut facts);
        match &self.task.phases[p - 1].done {
            Done::When(condition) => condition.holds(&facts),
            Done::Sequence { then, .. } => then.holds(&facts),
            Done::Lasting { condition, at_end, .. } => {
                condition.holds(&facts) && at_end.as_ref().is_none_or(|at_end| at_end.holds(&facts))
            }
            Done::Milestones(milestones) => {
                milestones.iter().all(|milestone| milestone.condition.holds(&facts))
            }
            Done::Unless { .. } => panic!("none of the benchmark's phases can be spoiled"),
        }
    }

    /// Returns true if the sequence of phase `p` begins in the world modified by `change`. The sequence must
    /// not be broken when it begins.
    pub fn begins(&self, p: usize, change: impl Fn(&mut Facts)) -> bool {
        let mut facts = self.start.clone();
        change(&mut facts);
        let Done::Sequence { first, broken, .. } = &self.task.phases[p - 1].done else {
            panic!("p{p} of {} is no sequence", self.task.id)
        };
        let is_broken = broken.as_ref().is_some_and(|broken| broken.holds(&facts));
        assert_ne!(first.holds(&facts), is_broken, "{} p{p}", self.task.id);
        first.holds(&facts)
    }

    /// Checks the threshold at which a sequence begins, like [`Scene::threshold`].
    pub fn beginning(&self, p: usize, threshold: f32, large: bool, change: impl Fn(&mut Facts, f32)) {
        let at = |share: f32| self.begins(p, |facts| change(facts, threshold * share));
        let (good, bad) = if large { (OUTSIDE, INSIDE) } else { (INSIDE, OUTSIDE) };
        assert!(at(good), "{} p{p} begins at {}", self.task.id, threshold * good);
        assert!(!at(bad), "{} p{p} begins at {}", self.task.id, threshold * bad);
    }

    /// Checks that phase `p` is done on one side of `threshold` and not on the other. With `large`, it is
    /// done above the threshold.
    pub fn threshold(&self, p: usize, threshold: f32, large: bool, change: impl Fn(&mut Facts, f32)) {
        let at = |share: f32| self.done(p, |facts| change(facts, threshold * share));
        let (good, bad) = if large { (OUTSIDE, INSIDE) } else { (INSIDE, OUTSIDE) };
        assert!(at(good), "{} p{p} at {}", self.task.id, threshold * good);
        assert!(!at(bad), "{} p{p} at {}", self.task.id, threshold * bad);
    }

    /// Checks the limits within which phase `p` accepts `object` as released and at rest. `settle` places the
    /// object.
    pub fn rest(&self, p: usize, object: &str, limits: &AtRest, settle: impl Fn(&mut Facts)) {
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

pub fn changed<'a>(facts: &'a mut Facts, name: &str) -> &'a mut ObjectFacts {
    facts.objects.iter_mut().find(|object| object.name == name).unwrap()
}

pub fn hold(facts: &mut Facts, robot: usize, side: Side, object: &str) {
    let object = changed(facts, object);
    object.hands[robot][side] = Grip::Holding;
    object.untouched_s = 0.0;
}

/// Makes each of these robots hold `object` with its left hand.
pub fn held_by(facts: &mut Facts, robots: &[usize], object: &str) {
    robots.iter().for_each(|robot| hold(facts, *robot, Side::Left, object));
}

/// Places `object`, untouched and with no rotation, at an offset from `target`.
pub fn put(facts: &mut Facts, object: &str, target: &str, beside_m: Vector) {
    let target_m = facts.position_m(target);
    let object = changed(facts, object);
    object.pose_in_world = Pose::from_translation(target_m + beside_m);
    object.untouched_s = 10.0;
}

pub fn raise(facts: &mut Facts, object: &str, by_m: f32) {
    let object = changed(facts, object);
    object.pose_in_world.translation.z = object.rest_height_m + by_m;
}

/// Tilts an object about its own origin and the world's x axis.
pub fn tilt(facts: &mut Facts, object: &str, by_deg: f32) {
    changed(facts, object).pose_in_world.rotation = Rotation::from_rotation_x(by_deg.to_radians());
}
