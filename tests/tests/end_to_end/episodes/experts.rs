//! Tests of experts: they solve their tasks with real physics within the benchmark protocol's step limit, on
//! held-out seeds. After a slip, on a seed used for tuning, the hand regrasps its load.

use std::ops::RangeInclusive;
use std::thread::available_parallelism;

use tandem_episodes::players::{self, Episode, InProcess, PlayerError, PrivilegedEpisode, experts};
use tandem_episodes::tasks::{self, Task};
use tandem_episodes::{
    A, B, C, CameraModel, Controller, EpisodeSpec, Facts, Instructions, RendererKind, RobotFile, Sensing,
    Session, Variation, tandem_plus,
};
use tandem_evaluation::evaluation::{EvaluationPlan, ExistingRun, KeptFiles, Shard, Starts, evaluate};
use tandem_evaluation::policies::{EpisodeOutput, Policy};
use tandem_sim::{SensorModel, Side};
use tandem_tools_spec::{ActCall, Assistance, Protocol, ToolCall, ToolReply};

/// Tasks without walking.
const STANDING: [&str; 4] = ["handover", "pouring", "frame_hang", "co_pouring"];

/// Held-out seeds, drawn at random from 7000-7099 on 2026-11-23, before any of these seeds was ever played.
/// No table reports them, and they are not used for tuning. They are never changed to make this test pass.
/// Experts fail in two episodes in a thousand. Three seeds cannot distinguish this from one in a hundred, and
/// each change of physics or controller changes which episodes fail. So the test tolerates a single failure,
/// to be investigated on other seeds, but not two of one task. Earlier the test used seeds 3 (reported in
/// tables), 6100 (used to tune the recovery after a slip), and 6101.
const SEEDS: [u32; 3] = [7030, 7054, 7081];

/// Plays the experts of `tasks`. Checks that phases are reached in order, and that at most `may_fail`
/// episodes fail in total and at most one of each task. No robot may fall, whether the task is solved or not.
fn solve(tasks: Vec<Task>, may_fail: usize) {
    let plan = EvaluationPlan {
        player: players::find("expert").expect("a player"),
        protocol: Protocol::Benchmark,
        scene: None,
        robot: RobotFile::default(),
        locomotion: Controller::Balance,
        sensing: Sensing::default(),
        // Experts act on ground truth, and use none of the additional information of `full`.
        assistance: Assistance::Paper,
        disclosure: Assistance::Paper.disclosure(),
        hints: Assistance::Paper.hints(),
        instructions: Instructions::default(),
        variation: Variation::default(),
        stress: None,
        thinking_limit_s: None,
        renderer: RendererKind::Cpu,
        camera: CameraModel::Ideal,
        tasks: tasks.clone(),
        seeds: SEEDS.into(),
        starts: Starts::Task,
        shard: Shard::WHOLE,
        jobs: available_parallelism().map_or(1, usize::from),
        record: false,
        files: KeptFiles::default(),
        retries: EvaluationPlan::DEFAULT_RETRIES,
        seed_key: None,
        existing: ExistingRun::Refuse,
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let played = evaluate(&plan, folder.path(), &|_| {}).expect("worlds can be built").episodes;
    assert_eq!(played.len(), tasks.len() * SEEDS.len());
    let mut failed = Vec::new();
    for episode in &played {
        let task = tasks.iter().find(|task| task.id == episode.result.task).expect("a task of the plan");
        let result = &episode.result;
        let times_s: Vec<f64> = result.phases.0.iter().filter_map(|(_, time_s)| *time_s).collect();
        assert!(times_s.is_sorted() && times_s.iter().all(|time_s| *time_s > 0.0), "{episode:?}");
        if times_s.len() < task.phases.len() {
            failed.push((&task.id, episode.spec.seed, times_s.len()));
        }
        assert_eq!(result.falls, 0, "{episode:?}");
    }
    let twice = |task: &Task| failed.iter().filter(|(id, ..)| **id == task.id).count() > 1;
    let fails_too_often = failed.len() > may_fail || tasks.iter().any(twice);
    assert!(!fails_too_often, "task, seed, phases reached: {failed:?}");
}

/// Returns the benchmark's tasks that have an expert, either those without walking (`standing`) or those with
/// walking.
fn solved(standing: bool) -> Vec<Task> {
    let is_wanted = |task: &&Task| STANDING.contains(&task.id.as_str()) == standing && experts::solves(task);
    tasks::cohub().iter().filter(is_wanted).cloned().collect()
}

#[test]
fn experts_that_stand_solve_their_tasks() {
    solve(solved(true), 1);
}

#[test]
fn experts_that_walk_solve_their_tasks() {
    solve(solved(false), 2);
}

#[test]
fn experts_of_tandem_plus_solve_their_tasks() {
    solve(tandem_plus().to_vec(), 1);
}

/// An idle policy reaches no phase. A team without communication solves exactly the seeds on which its guess
/// is right.
#[test]
fn tandem_plus_needs_somebody_who_acts_and_words() {
    for task in tandem_plus() {
        let reached = |player: &str, seed: u32| {
            let spec = EpisodeSpec::new(task, seed, Protocol::Benchmark).assisted(Assistance::Paper);
            let nowhere = EpisodeOutput { folder: "".as_ref(), record: false, pages: false };
            let played = players::find(player).expect("a player").play_episode(&spec, nowhere);
            let times_s = played.expect("worlds can be built").result.phases.0;
            times_s.iter().filter(|(_, time_s)| time_s.is_some()).count()
        };
        let is_right = |seed: &u32| {
            let spec = EpisodeSpec::new(task, *seed, Protocol::Benchmark);
            experts::guessed(&spec).chosen == spec.task.chosen
        };
        assert_eq!(reached("idle", 2000), 0, "{}", task.id);
        let right = (2000..2100).find(is_right).expect("a right guess");
        assert_eq!(reached("no_words", right), task.phases.len(), "{} seed {right}", task.id);
        for wrong in (2000..2100).filter(|seed| !is_right(seed)).take(2) {
            assert!(reached("no_words", wrong) < task.phases.len(), "{} seed {wrong}", task.id);
        }
    }
}

/// An episode in which A's left hand opens and rises for a moment while the table is carried.
struct Slip {
    episode: InProcess,
    /// True once the hand has lost its grip; `took_again` is true once it holds the table again.
    slipped: bool,
    took_again: bool,
}

const TABLE: &str = "office_table";
const SLIPS_AT_S: RangeInclusive<f64> = 14.0..=15.0;

impl Episode for Slip {
    fn call(&mut self, mut call: ToolCall) -> Result<ToolReply, PlayerError> {
        let facts = self.episode.session.facts();
        let holds = facts.holds(A, Side::Left, TABLE);
        if let ToolCall::Act(ActCall::MoveWrists(command)) = &mut call
            && SLIPS_AT_S.contains(&facts.time_s)
        {
            for hands in command.robots.iter_mut().filter(|hands| hands.robot == "A") {
                hands.left_fingers_rad = Some([0.0; 7]);
                hands.left_position_m = hands.left_position_m.map(|[x, y, z]| [x, y, z + 0.08]);
            }
        }
        self.slipped |= SLIPS_AT_S.contains(&facts.time_s) && !holds;
        self.took_again |= self.slipped && holds && facts.lift_m(TABLE) > 0.03;
        self.episode.call(call)
    }
}

impl PrivilegedEpisode for Slip {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.episode.facts()
    }
}

#[test]
fn a_hand_that_slips_off_a_load_takes_it_again() {
    let spec = EpisodeSpec::new(&tasks::find("table_align").expect("a task"), 6100, Protocol::Agentic);
    let session = Session::start(&spec, None).expect("a session");
    let mut slip = Slip { episode: InProcess::new(session), slipped: false, took_again: false };
    players::find("expert").expect("a player").play(&spec, &mut slip).expect("an expert that goes on");
    assert!(slip.slipped && slip.took_again);
    assert_eq!(slip.episode.session.reached_phases(), 3);
}

/// An episode in which B and C lift a table by its legs.
struct Lift {
    episode: InProcess,
    /// Largest distance of a carrier from its best position when the table is lifted.
    most_off_m: Option<f32>,
}

const CONSOLE: &str = "console_table";
/// Distance from the table's middle to a carrier's pelvis: 0.37 m to the legs, and 0.38 m beyond them.
const MIDDLE_FROM_PELVIS_M: f32 = 0.75;

impl Episode for Lift {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let facts = self.episode.session.facts();
        if self.most_off_m.is_none() && facts.lift_m(CONSOLE) > 0.06 {
            let table = facts.object(CONSOLE).pose_in_world.inverse();
            let off_m = |(robot, ahead_m): (usize, f32)| {
                let mut pelvis_m = (table * facts.robots[robot].pelvis_in_world).translation;
                pelvis_m.x -= ahead_m;
                pelvis_m.truncate().length()
            };
            let pair = [(B, MIDDLE_FROM_PELVIS_M), (C, -MIDDLE_FROM_PELVIS_M)];
            self.most_off_m = pair.into_iter().map(off_m).reduce(f32::max);
        }
        self.episode.call(call)
    }
}

impl PrivilegedEpisode for Lift {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.episode.facts()
    }
}

/// Regression test. On these seeds the carriers stepped towards their outstretched arms. They were 9 cm too
/// close when they lifted the table, their thighs pressed against the table's legs during the first steps,
/// and they fell.
#[test]
fn carriers_stand_where_they_are_to_when_they_lift() {
    for seed in [2009, 2103] {
        let spec = EpisodeSpec::new(&tasks::find("move_house").expect("a task"), seed, Protocol::Benchmark);
        let session = Session::start(&spec, None).expect("a session");
        let mut lift = Lift { episode: InProcess::new(session), most_off_m: None };
        players::find("expert").expect("a player").play(&spec, &mut lift).expect("an expert that carries on");
        let reached = lift.episode.session.reached_phases();
        let result = lift.episode.session.close();
        assert!(lift.most_off_m.is_some_and(|off_m| off_m < 0.05), "{seed}: {:?} m", lift.most_off_m);
        assert_eq!((reached, result.falls), (3, 0), "{seed}");
        // The task takes less than the available 30 s.
        let placed_s = result.phases.0.last().and_then(|(_, time_s)| *time_s);
        assert!(placed_s.is_some_and(|time_s| time_s < 27.0), "{seed}: {placed_s:?} s");
    }
}

/// An episode in which B carries a bottle to a table.
struct Carry {
    episode: InProcess,
    /// Largest tilt of the bottle in the hand since it was lifted.
    most_tilt_rad: f32,
}

const BOTTLE: &str = "bottle";

impl Episode for Carry {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let facts = self.episode.session.facts();
        if facts.holds_any(B, BOTTLE) && facts.lift_m(BOTTLE) > 0.02 {
            self.most_tilt_rad = self.most_tilt_rad.max(facts.tilt_rad(BOTTLE));
        }
        self.episode.call(call)
    }
}

impl PrivilegedEpisode for Carry {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        self.episode.facts()
    }
}

/// Regression test. The pelvis of a walking robot is lower than that of a standing robot. B carried the
/// bottle into the edge of the table, which turned the bottle by 45 degrees in the hand. The opening fingers
/// then knocked it over.
#[test]
fn a_bottle_is_carried_over_the_edge_of_the_table() {
    let spec = EpisodeSpec::new(&tasks::find("cart_service").expect("a task"), 2029, Protocol::Benchmark);
    let session = Session::start(&spec, None).expect("a session");
    let mut carry = Carry { episode: InProcess::new(session), most_tilt_rad: 0.0 };
    players::find("expert").expect("a player").play(&spec, &mut carry).expect("an expert that carries on");
    assert!((0.01..0.26).contains(&carry.most_tilt_rad), "{} rad", carry.most_tilt_rad);
    assert_eq!(carry.episode.session.reached_phases(), 3);
}

/// Regression test: hands that held the picture frame at its target while the loop settled on the peg
/// pushed both robots off balance. They stepped towards each other, and one fell.
#[test]
fn hands_give_way_while_the_picture_is_let_down() {
    for seed in [2004, 2021] {
        let spec = EpisodeSpec {
            sensing: Sensing { sensors: SensorModel::G1, ..Sensing::default() },
            ..EpisodeSpec::new(&tasks::find("frame_hang").expect("a task"), seed, Protocol::Benchmark)
        };
        let mut episode = InProcess::new(Session::start(&spec, None).expect("a session"));
        players::find("expert").expect("a player").play(&spec, &mut episode).expect("an expert that goes on");
        let reached = episode.session.reached_phases();
        assert_eq!((reached, episode.session.close().falls), (3, 0), "{seed}");
    }
}
