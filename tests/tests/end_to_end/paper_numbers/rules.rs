//! Tests of scenes, randomisation, budgets, the camera and the order of joints.

use std::time::Duration;

use tandem_episodes::{EpisodeSpec, Session, rules, tasks};
use tandem_sim::{CONTROL_HZ, PHYSICS_DT_S};
use tandem_tools_spec::{LookReply, Observe, Protocol, ToolReply};

use super::table::{self, Moves, TASKS};

#[test]
fn tasks_are_set_as_published() {
    let ids: Vec<&str> = tasks::cohub().iter().map(|task| task.id.as_str()).collect();
    assert_eq!(ids, TASKS.each_ref().map(|published| published.id));
    for published in &TASKS {
        let task = tasks::find(published.id).unwrap();
        assert_eq!(task.robots.len(), published.robots, "{}", task.id);
        assert!(task.scene.ends_with(published.scene), "{} in {}", task.id, task.scene);
        let collaborative: Vec<bool> = task.phases.iter().map(|phase| phase.collaborative).collect();
        if let Some(expected) = published.collaborative {
            assert_eq!(collaborative, expected, "{}", task.id);
        }
    }
}

#[test]
fn seeds_move_what_the_benchmark_moves_and_as_far() {
    for published in &TASKS {
        let task = tasks::find(published.id).unwrap();
        let ends = |range: &std::ops::RangeInclusive<f32>| [*range.start(), *range.end()];
        let groups = task.randomize.iter().map(|offset| offset.objects.iter().map(String::as_str).collect());
        let groups: Vec<Vec<&str>> = groups.collect();
        let drawn: Vec<Moves> = task
            .randomize
            .iter()
            .zip(&groups)
            .map(|(offset, objects)| Moves {
                objects,
                x_m: ends(&offset.x_m),
                y_m: ends(&offset.y_m),
                z_m: ends(&offset.z_m),
                // The published values are whole degrees.
                yaw_deg: ends(&offset.yaw_rad).map(|turn_rad| turn_rad.to_degrees().round()),
            })
            .collect();
        assert_eq!(drawn, published.moves, "{}", task.id);
    }
}

#[test]
fn budgets_are_as_published() {
    for published in &TASKS {
        let task = tasks::find(published.id).unwrap();
        let agentic = rules(Protocol::Agentic, &task);
        assert_eq!(agentic.steps_per_command, table::AGENTIC_STEPS_PER_COMMAND);
        assert_eq!(agentic.episode_steps, table::AGENTIC_EPISODE_STEPS);
        assert_eq!(agentic.initial_hold_steps, table::AGENTIC_HOLD_STEPS);
        assert_eq!(agentic.thinking, Some(Duration::from_secs(table::AGENTIC_THINKING_S)));
        assert_eq!(agentic.seeds, table::AGENTIC_SEEDS);
        let benchmark = rules(Protocol::Benchmark, &task);
        assert_eq!(benchmark.episode_steps, published.episode_steps, "{}", task.id);
        assert_eq!(benchmark.steps_per_command, table::BENCHMARK_STEPS_PER_COMMAND);
        assert_eq!((benchmark.initial_hold_steps, benchmark.thinking), (0, None));
        assert_eq!(benchmark.seeds, table::BENCHMARK_SEEDS);
    }
    assert_eq!(CONTROL_HZ, table::CONTROL_HZ);
    assert!((f64::from(PHYSICS_DT_S) * table::PHYSICS_HZ - 1.0).abs() < 1e-6);
}

#[test]
fn the_camera_and_the_joints_are_as_published() {
    let task = tasks::find("handover").unwrap();
    let mut session = Session::start(&EpisodeSpec::new(&task, 0, Protocol::Benchmark), None).unwrap();
    let ToolReply::Look(LookReply::Observe(seen)) = session.call(Observe::of_all().into()).unwrap() else {
        panic!("no observation")
    };
    for camera in &seen.cameras {
        assert_eq!([camera.width, camera.height], table::CAMERA_PX);
        let across_deg = 2.0 * (f64::from(camera.width) / 2.0 / camera.fx).atan().to_degrees();
        assert!((across_deg - table::CAMERA_HORIZONTAL_FOV_DEG).abs() < 0.1, "{across_deg} degrees across");
        // The z component of the rotation's third column is the vertical component of the optical axis, a
        // unit vector.
        let [w, x, y, z] = camera.camera_in_pelvis.quaternion_wxyz;
        let down_deg = -(w * w - x * x - y * y + z * z).asin().to_degrees();
        assert!((down_deg - table::CAMERA_DOWN_DEG).abs() < 0.1, "{down_deg} degrees down");
    }
    let briefing = session.briefing();
    for (group, count) in table::STATE {
        let names = briefing.kinds[0].joints.iter().map(|joint| joint.name.as_str());
        assert_eq!(names.filter(|name| self::group(name) == group).count(), count, "{group}");
    }
    let (joints, base) = briefing.action_row.split_at(briefing.action_row.len() - table::ACTION_BASE.len());
    let groups: Vec<&str> = joints.iter().map(|name| group(name)).collect();
    let expected = table::ACTION.iter().flat_map(|(group, count)| vec![*group; *count]);
    assert_eq!(groups, expected.collect::<Vec<_>>());
    assert_eq!(base, table::ACTION_BASE);
}

/// Returns the group of a joint, given Unitree's name.
fn group(joint: &str) -> &'static str {
    let is_of = |parts: &[&str]| parts.iter().any(|part| joint.contains(part));
    match joint {
        _ if is_of(&["hip", "knee", "ankle"]) => "leg",
        _ if is_of(&["waist"]) => "waist",
        _ if is_of(&["hand"]) => "hand",
        _ if is_of(&["shoulder", "elbow", "wrist"]) => "arm",
        _ => "none",
    }
}
