//! Evaluation plans shared by the tests of policies.

use std::path::Path;

use tandem_episodes::{
    CameraModel, Controller, Instructions, Recorder, Recording, RendererKind, RobotFile, Sensing, Variation,
    tasks,
};
use tandem_evaluation::evaluation::{
    Evaluation, EvaluationPlan, ExistingRun, KeptFiles, Shard, Starts, evaluate,
};
use tandem_evaluation::policies::Policy;
use tandem_tools_spec::{Assistance, Protocol};

/// Returns a plan for Handover on `seeds`, under the benchmark protocol.
pub fn plan(player: &dyn Policy, seeds: Vec<u32>, record: bool) -> EvaluationPlan<'_> {
    EvaluationPlan {
        player,
        protocol: Protocol::Benchmark,
        robot: RobotFile::default(),
        scene: None,
        locomotion: Controller::Balance,
        sensing: Sensing::default(),
        assistance: Assistance::Paper,
        disclosure: Assistance::Paper.disclosure(),
        hints: Assistance::Paper.hints(),
        instructions: Instructions::default(),
        variation: Variation::default(),
        stress: None,
        thinking_limit_s: None,
        renderer: RendererKind::Cpu,
        camera: CameraModel::Ideal,
        tasks: vec![tasks::find("handover").expect("a task")],
        seeds,
        starts: Starts::Task,
        shard: Shard::WHOLE,
        jobs: 2,
        record,
        files: KeptFiles::default(),
        retries: EvaluationPlan::DEFAULT_RETRIES,
        seed_key: None,
        existing: ExistingRun::Refuse,
    }
}

/// Plays the plan, with its results in `folder`.
pub fn play(plan: &EvaluationPlan, folder: &Path) -> Evaluation {
    evaluate(plan, folder, &|_| {}).expect("it is played")
}

/// Returns the measured angle of joint number `joint` of every robot, at the end of the recorded episode
/// `name`.
pub fn last_angles_rad(folder: &Path, name: &str, joint: usize) -> Vec<f32> {
    let path = folder.join("episodes").join(name).join(Recorder::FILE_NAME);
    let recording = Recording::read(&path).expect("a recording");
    let last = recording.steps().last().expect("a step").expect("a whole step");
    last.robots.iter().map(|robot| robot.sensed.joints.q_rad[joint]).collect()
}
