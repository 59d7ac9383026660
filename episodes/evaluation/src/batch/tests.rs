//! Batches of Handover, the cheapest world.

use tandem_episodes::{
    RendererKind,
    rows::{RowContract, between_rows, joint_row},
    tasks,
};
use tandem_tools_spec::{JointChunk, Protocol, SendJointChunk};

use super::*;

const WORLDS: usize = 3;
const ROBOTS: usize = 2;

fn spec(reward: RewardKind) -> BatchSpec {
    BatchSpec {
        episode: EpisodeSpec::new(&tasks::find("handover").unwrap(), 0, Protocol::Benchmark),
        worlds: WORLDS,
        threads: 2,
        actions: ActionKind::Joints,
        steps_per_row: 1,
        reward,
        pictures_px: None,
        record: None,
    }
}

/// Returns actions with which robots stand and keep their upper bodies at zero.
fn standing(worlds: usize) -> Vec<f32> {
    let mut row = [0.0; 35];
    row[34] = 0.74;
    row.repeat(worlds * ROBOTS)
}

fn states(worlds: usize) -> Vec<f32> {
    vec![0.0; worlds * ROBOTS * STATE_COLUMNS]
}

fn stepped(batch: &mut Batch, autoreset: Autoreset, rows: &mut [f32]) -> Vec<WorldStep> {
    let actions = standing(batch.spec().worlds);
    let step = BatchStep { action_rows: &actions, autoreset, looks: true };
    batch.step(step, SeenArrays::of_states(rows), SeenArrays::default()).unwrap()
}

#[test]
fn a_batch_ends_in_the_states_of_its_episodes_one_by_one() {
    let mut batch = Batch::new(spec(RewardKind::Sparse));
    let mut seen = states(WORLDS);
    batch
        .reset(&[Some(Some(2001)), Some(Some(2002)), Some(Some(2003))], SeenArrays::of_states(&mut seen))
        .unwrap();
    for _ in 0..20 {
        stepped(&mut batch, Autoreset::NextStep, &mut seen);
    }
    for world in 0..WORLDS {
        let episode = EpisodeSpec { seed: 2001 + world as u32, ..batch.spec().episode.clone() };
        let mut alone = Session::start(&episode, None).unwrap();
        let chunk = |robot: &str| JointChunk {
            robot: robot.into(),
            rows: vec![standing(1)[..35].iter().copied().map(f64::from).collect(); 20],
        };
        alone.call(SendJointChunk { robots: vec![chunk("A"), chunk("B")] }.into()).unwrap();
        assert_eq!(batch.state_hash(world).unwrap(), alone.state_hash(), "world {world}");
        let own = &seen[world * ROBOTS * STATE_COLUMNS..][..STATE_COLUMNS];
        assert_eq!(own[..STATE_COLUMNS - 4], alone.present().robots[0].sensed.joints.q_rad);
        assert_eq!(own[STATE_COLUMNS - 1], 0.74);
    }
}

#[test]
fn a_state_is_within_the_ranges_of_its_columns_at_the_start() {
    let mut batch = Batch::new(BatchSpec { worlds: 1, ..spec(RewardKind::Sparse) });
    let mut seen = states(1);
    batch.reset(&[Some(Some(2000))], SeenArrays::of_states(&mut seen)).unwrap();
    let contract = RowContract::of(&batch.spec().episode, ActionKind::Joints).unwrap();
    assert_eq!(contract.state.len(), STATE_COLUMNS);
    for row in seen.chunks_exact(STATE_COLUMNS) {
        for (value, column) in row.iter().zip(&contract.state) {
            assert!((column.min..=column.max).contains(value), "{column:?}: {value}");
        }
    }
}

#[test]
fn a_row_of_a_lower_rate_is_reached_on_a_straight_line() {
    let mut slow = Batch::new(BatchSpec { worlds: 1, steps_per_row: 5, ..spec(RewardKind::Sparse) });
    let mut fast = Batch::new(BatchSpec { worlds: 1, ..spec(RewardKind::Sparse) });
    let mut seen = states(1);
    let begin = |batch: &mut Batch, seen: &mut [f32]| {
        batch.reset(&[Some(Some(2000))], SeenArrays::of_states(seen)).unwrap();
        batch.ask(0, |session| joint_row(&session.present().robots[0].command)).unwrap()
    };
    let before_row = begin(&mut fast, &mut seen);
    begin(&mut slow, &mut seen);
    let mut goal_row = before_row.clone();
    (goal_row[3], goal_row[31], goal_row[34]) = (before_row[3] + 0.5, 0.2, before_row[34] - 0.05);
    let flat = |row: &[f64]| row.iter().map(|value| *value as f32).collect::<Vec<_>>().repeat(ROBOTS);
    let mut take = |batch: &mut Batch, row: &[f64]| {
        let step = BatchStep { action_rows: &flat(row), autoreset: Autoreset::Disabled, looks: false };
        batch.step(step, SeenArrays::of_states(&mut seen), SeenArrays::default()).unwrap().remove(0)
    };
    let goal_row: Vec<f64> = goal_row.iter().map(|value| f64::from(*value as f32)).collect();
    let slow_outcome = take(&mut slow, &goal_row);
    let shares = [0.2, 0.4, 0.6, 0.8, 1.0];
    let fast_outcome = shares.map(|share| take(&mut fast, &between_rows(&before_row, &goal_row, share)));
    assert_eq!((slow_outcome.env_steps, fast_outcome[4].env_steps), (5, 5));
    let elbow = |session: &mut Session| session.present().robots[0].sensed.joints.q_rad[18];
    let elbows_rad = [&mut slow, &mut fast].map(|batch| batch.ask(0, elbow).unwrap());
    // Targets on the line differ by the rounding of the second batch's rows to single precision.
    assert!((elbows_rad[0] - elbows_rad[1]).abs() < 1e-4, "{elbows_rad:?}");
    let held_command = slow.ask(0, |session| joint_row(&session.present().robots[0].command)).unwrap();
    assert_eq!(held_command, goal_row);
}

#[test]
fn seeds_are_those_of_the_episodes_index() {
    let mut batch = Batch::new(BatchSpec { worlds: 2, ..spec(RewardKind::Sparse) });
    let mut seen = states(2);
    let seeds =
        |begun: Vec<Option<WorldStep>>| begun.into_iter().flatten().map(|step| step.seed).collect::<Vec<_>>();
    assert_eq!(
        seeds(batch.reset(&[Some(None), Some(None)], SeenArrays::of_states(&mut seen)).unwrap()),
        [2000, 2001]
    );
    // The episode of world 0 ends early, twice.
    for round in 1..=2 {
        held(&batch.worlds[0]).over = true;
        let begun = stepped(&mut batch, Autoreset::NextStep, &mut seen);
        assert_eq!((begun[0].seed, begun[0].env_steps, begun[0].reward), (2000 + 2 * round, 0, 0.0));
        assert_eq!((begun[1].seed, begun[1].env_steps), (2001, round));
    }
    assert_eq!(
        seeds(batch.reset(&[Some(None), Some(None)], SeenArrays::of_states(&mut seen)).unwrap()),
        [2002, 2003]
    );
    assert_eq!(seeds(batch.reset(&[None, Some(Some(7))], SeenArrays::of_states(&mut seen)).unwrap()), [7]);
}

#[test]
fn an_episode_that_begins_in_the_same_step_leaves_its_last_state() {
    let mut batch = Batch::new(BatchSpec { worlds: 1, threads: 1, ..spec(RewardKind::Sparse) });
    let (mut seen, mut last) = (states(1), states(1));
    batch.reset(&[Some(Some(2000))], SeenArrays::of_states(&mut seen)).unwrap();
    let begin = seen.clone();
    // An action with which no robot keeps its balance.
    let mut row = [0.0; 35];
    (row[28], row[30]) = (2.0, 0.5);
    row[31..].copy_from_slice(&[-0.4, 0.4, 0.6, 0.4]);
    let actions = row.repeat(ROBOTS);
    let mut steps = 0;
    let fell = loop {
        let step = BatchStep { action_rows: &actions, autoreset: Autoreset::SameStep, looks: true };
        let outcome = batch
            .step(step, SeenArrays::of_states(&mut seen), SeenArrays::of_states(&mut last))
            .unwrap()
            .swap_remove(0);
        steps += 1;
        if outcome.terminated || outcome.truncated {
            break outcome;
        }
        assert_eq!(outcome.next_seed, None);
    };
    assert!(fell.terminated && fell.fallen.contains(&true), "{fell:?}");
    assert_eq!((fell.env_steps, fell.seed, fell.next_seed), (steps, 2000, Some(2001)));
    assert_ne!(last[..STATE_COLUMNS - 4], seen[..STATE_COLUMNS - 4]);
    assert_eq!(seen.len(), begin.len());
    let next = stepped(&mut batch, Autoreset::SameStep, &mut seen);
    assert_eq!((next[0].env_steps, next[0].seed), (1, 2001));
}

/// If this build and the machine have a GPU, it renders the images of all worlds together.
#[test]
fn pictures_are_drawn_where_the_policy_looks() {
    for renderer in [RendererKind::Cpu, RendererKind::Gpu] {
        check_pictures(renderer);
    }
}

fn check_pictures(renderer: RendererKind) {
    let size_px = [32, 24];
    let mut batch = Batch::new(BatchSpec {
        worlds: 2,
        pictures_px: Some(size_px),
        episode: EpisodeSpec { renderer, ..spec(RewardKind::Sparse).episode },
        ..spec(RewardKind::Sparse)
    });
    let (mut seen, mut pixels) = (states(2), vec![0; 2 * ROBOTS * 32 * 24 * 3]);
    batch
        .reset(
            &[Some(Some(2000)), Some(Some(2001))],
            SeenArrays { state_rows: &mut seen, pictures: &mut pixels },
        )
        .unwrap();
    assert_eq!(pixels[..pixels.len() / 2], batch.draw(0, size_px).unwrap());
    let begin = pixels.clone();
    let actions = standing(2);
    for looks in [false, true] {
        let step = BatchStep { action_rows: &actions, autoreset: Autoreset::NextStep, looks };
        let arrays = SeenArrays { state_rows: &mut seen, pictures: &mut pixels };
        batch.step(step, arrays, SeenArrays::default()).unwrap();
        assert_eq!(pixels != begin, looks);
    }
    assert_eq!(pixels[pixels.len() / 2..], batch.draw(1, size_px).unwrap());
}

#[test]
fn a_step_is_refused_as_a_whole() {
    let mut batch = Batch::new(BatchSpec { worlds: 2, ..spec(RewardKind::Sparse) });
    let mut seen = states(2);
    let refused = |batch: &mut Batch, actions: &[f32], autoreset| {
        let step = BatchStep { action_rows: actions, autoreset, looks: false };
        batch
            .step(step, SeenArrays::of_states(&mut states(2)), SeenArrays::default())
            .unwrap_err()
            .to_string()
    };
    let mut actions = standing(2);
    let text = refused(&mut batch, &actions, Autoreset::NextStep);
    assert_eq!(text, "world 0 has no episode under way; reset it first");
    batch.reset(&[Some(None), Some(None)], SeenArrays::of_states(&mut seen)).unwrap();
    let before = batch.state_hash(0).unwrap();
    actions[35 * ROBOTS] = f32::NAN;
    let text = refused(&mut batch, &actions, Autoreset::NextStep);
    assert!(text.contains("row 0"), "{text}");
    assert_eq!(batch.state_hash(0).unwrap(), before);
    held(&batch.worlds[1]).over = true;
    let text = refused(&mut batch, &standing(2), Autoreset::Disabled);
    assert_eq!(text, "world 1 has no episode under way; reset it first");
    assert!(batch.draw(2, [8, 8]).unwrap_err().to_string().contains("0 to 1"));
}

#[test]
fn what_cannot_be_recorded_does_not_begin() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let record = Some(file.path().join("runs"));
    let mut batch = Batch::new(BatchSpec { worlds: 1, record, ..spec(RewardKind::Sparse) });
    let mut seen = states(1);
    let refused = batch.reset(&[Some(Some(2000))], SeenArrays::of_states(&mut seen)).unwrap_err().to_string();
    assert!(refused.starts_with("the episode of seed 2000 cannot be recorded: "), "{refused}");
    let step = BatchStep { action_rows: &standing(1), autoreset: Autoreset::NextStep, looks: false };
    let refused = batch.step(step, SeenArrays::of_states(&mut seen), SeenArrays::default()).unwrap_err();
    assert_eq!(refused.to_string(), "world 0 has no episode under way; reset it first");
}

#[test]
fn wrists_go_where_a_row_says() {
    let mut batch =
        Batch::new(BatchSpec { worlds: 1, actions: ActionKind::Wrists, ..spec(RewardKind::Dense) });
    let mut seen = states(1);
    batch.reset(&[Some(Some(2000))], SeenArrays::of_states(&mut seen)).unwrap();
    let mut row = [0.0; 32];
    row[..7].copy_from_slice(&[0.25, 0.25, 0.10, 1.0, 0.0, 0.0, 0.0]);
    row[7..14].copy_from_slice(&[0.25, -0.25, 0.10, 1.0, 0.0, 0.0, 0.0]);
    row[31] = 0.74;
    let actions = row.repeat(ROBOTS);
    let mut progress = 0.0;
    for _ in 0..75 {
        let step = BatchStep { action_rows: &actions, autoreset: Autoreset::NextStep, looks: false };
        let outcome = batch.step(step, SeenArrays::of_states(&mut seen), SeenArrays::default()).unwrap();
        progress += outcome[0].reward;
    }
    let wrist =
        |session: &mut Session| session.present().robots[0].sensed.pelvis_from_wrist.right.translation;
    let wrist = batch.ask(0, wrist).unwrap();
    // Arms that are flung forward make a robot step, and wrists sway with its pelvis.
    assert!((wrist - tandem_sim::Vector::new(0.25, -0.25, 0.10)).length() < 0.08, "{wrist}");
    // Rewards add up to the progress since the beginning: the hands have come nearer to the bottle.
    let begin = Session::start(&EpisodeSpec { seed: 2000, ..batch.spec().episode.clone() }, None).unwrap();
    let now = batch.ask(0, |session| session.progress()).unwrap();
    assert!((now - begin.progress() - progress).abs() < 1e-6 && progress > 0.01, "{now} {progress}");
}
