//! Tests of undisturbed worlds: scenes settle, objects stay in place, and waiting reaches no phase.

use crate::common::*;
use tandem_episodes::tasks;
use tandem_tools_spec::Protocol;

#[test]
fn scenes_settle_within_a_second_and_start_again_bit_for_bit() {
    for task in tasks::cohub() {
        // This protocol has no initial hold.
        let [mut session, mut again] = [(); 2].map(|()| start(&task.id, 1, Protocol::Benchmark));
        assert_eq!(session.state_hash(), again.state_hash(), "{}", task.id);
        wait(&mut session, 50);
        wait(&mut again, 50);
        assert_eq!(session.state_hash(), again.state_hash(), "{}", task.id);
        for object in session.facts().objects {
            let speed_m_s = object.velocity_m_s.length();
            assert!(speed_m_s < 0.01, "{}: {} moves at {speed_m_s} m/s", task.id, object.name);
        }
    }
}

/// Waits in every task: objects move less than `drift_m`, no robot falls, no phase is reached.
fn idle(wait_s: u32, drift_m: f32) {
    for task in tasks::cohub() {
        let mut session = start(&task.id, 1, Protocol::Agentic);
        let before = session.facts();
        (0..2 * wait_s).for_each(|_| drop(wait(&mut session, 25)));
        for (before, after) in before.objects.iter().zip(&session.facts().objects) {
            let moved_m = before.pose_in_world.translation.distance(after.pose_in_world.translation);
            println!("{}: {} has moved {moved_m} m in {wait_s} s", task.id, before.name);
            assert!(moved_m < drift_m, "{}: {} has moved {moved_m} m in {wait_s} s", task.id, before.name);
        }
        let status = status(&mut session);
        assert!(status.phases.is_empty(), "{}: {:?}", task.id, status.phases);
        assert!(!status.fallen.iter().any(|robot| robot.fallen), "{}: {:?}", task.id, status.fallen);
    }
}

/// A duration short enough for every test run. The drift limit of 2 mm in 60 s scales to a sixth of a
/// millimetre.
#[test]
fn objects_stay_and_idling_reaches_nothing() {
    idle(5, 0.002 / 12.0);
}

#[test]
#[ignore = "a minute of every task takes more than a minute; run it with --ignored"]
fn objects_stay_for_a_minute() {
    idle(60, 0.002);
}
