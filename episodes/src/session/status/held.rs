//! Objects in hands: their places in the frame of the robot that holds them.

use tandem_sim::{ObjectModel, Pose, Side, Vector};
use tandem_tools_spec::{HeldObject, PoseFrame};

use super::super::Session;
use crate::convert::{coarse, isometry_to_sim};
use crate::scoring::{Facts, ROBOT_NAMES};

impl Session {
    /// Returns the objects in the hands of all robots, or in those of an operator's robot, in `frame`.
    pub(in crate::session) fn held(
        &self,
        facts: &Facts,
        operator: Option<&str>,
        frame: PoseFrame,
    ) -> Vec<HeldObject> {
        let own = |robot: &usize| operator.is_none_or(|operator| ROBOT_NAMES[*robot] == operator);
        let hands =
            (0..facts.robots.len()).filter(own).flat_map(|robot| Side::BOTH.map(|side| (robot, side)));
        let held = hands.flat_map(|(robot, side)| {
            let objects = facts.objects.iter().map(|object| object.name.as_str());
            let objects = objects.filter(move |object| facts.holds(robot, side, object));
            objects.map(move |object| (robot, side, object))
        });
        held.map(|(robot, side, object)| self.held_object(facts, (robot, side), object, frame)).collect()
    }

    fn held_object(
        &self,
        facts: &Facts,
        (robot, side): (usize, Side),
        object: &str,
        frame: PoseFrame,
    ) -> HeldObject {
        let found = facts.object(object);
        let frame_from_pelvis = self.motions[robot].pelvis_from(frame).inverse();
        let frame_from_world =
            isometry_to_sim(&frame_from_pelvis) * facts.robots[robot].pelvis_in_world.inverse();
        let frame_from_object = frame_from_world * found.pose_in_world;
        let wire = |vector: Vector| vector.to_array().map(|part| coarse(part.into()));
        HeldObject {
            robot: ROBOT_NAMES[robot].into(),
            hand: side.name().into(),
            object: object.into(),
            frame,
            middle_m: wire(frame_from_object * middle_m(&found.model)),
            axis: wire(frame_from_object.rotation * Vector::Z),
            lowest_m: coarse(facts.lowest_m(object).into()),
        }
    }
}

/// Returns the middle of an object's extents along its own axes, in its own frame.
fn middle_m(model: &ObjectModel) -> Vector {
    let reach_m = |direction: Vector| model.reach_m(&Pose::IDENTITY, direction);
    let middle_m = |axis: Vector| 0.5 * (reach_m(axis) - reach_m(-axis));
    Vector::new(middle_m(Vector::X), middle_m(Vector::Y), middle_m(Vector::Z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scoring::{A, Grip};
    use crate::spec::EpisodeSpec;
    use crate::tasks;
    use tandem_tools_spec::Protocol;

    #[test]
    fn a_held_thing_is_told_where_it_is_to_its_robot() {
        let task = tasks::find("handover").unwrap();
        let session = Session::start(&EpisodeSpec::new(&task, 0, Protocol::Benchmark), None).unwrap();
        let mut facts = session.facts().grip(A, Side::Right, "bottle", Grip::Holding);
        let held = |facts: &Facts, operator| session.held(facts, operator, PoseFrame::Level);
        assert_eq!(held(&session.facts(), None), []);
        let pelvis_in_world = facts.robots[A].pelvis_in_world;
        // The bottle stands ahead of A; its middle is half of its 0.3 m above its bottom.
        facts.object_mut("bottle").pose_in_world.translation =
            pelvis_in_world.translation + Vector::new(0.3, -0.1, 0.0);
        facts.object_mut("bottle").pose_in_world.rotation = Default::default();
        let [found] = &held(&facts, None)[..] else { panic!("one thing is held") };
        assert_eq!((&*found.robot, &*found.hand, &*found.object), ("A", "right", "bottle"));
        for (along_m, expected_m) in found.middle_m.iter().zip([0.3, -0.1, 0.15]) {
            assert!((along_m - expected_m).abs() < 0.01, "{found:?}");
        }
        assert!((found.lowest_m - f64::from(pelvis_in_world.translation.z)).abs() < 0.002, "{found:?}");
        assert!(found.axis[2] > 0.999, "{found:?}");
        assert_eq!(held(&facts, Some("A")).len(), 1);
        assert_eq!(held(&facts, Some("B")), []);
    }
}
