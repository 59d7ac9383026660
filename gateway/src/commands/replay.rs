//! `tandem replay`: recordings simulated again, filmed, exported, or rendered with depth.

mod phases;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use indicatif::{ProgressBar, ProgressStyle};
use tandem_episodes::replay::{
    Difference, DrawnPictures, EpisodeCamera, FilmPlan, PictureSize, PicturesPlan, Verdict, Verification,
    draw_all, export, film, verify,
};
use tandem_episodes::{
    CameraModel, Checkpoint, EpisodeSpec, FAILED_STEP_FILE, Recording, RendererKind, Session, printable,
};
use tandem_tools_spec::ResultReply;

use super::CommandResult;
use crate::settings::one_of;

/// Replay recordings: describe, verify, film or export them, or render the images and depth of every camera.
#[derive(Debug, clap::Args)]
pub struct ReplayArgs {
    /// Recordings, for example runs/handover-seed0/episode.mcap, or their folders, or the
    /// failed_step.checkpoint beside one.
    #[arg(value_name = "FILES", required = true)]
    recordings: Vec<PathBuf>,
    /// Simulate again and compare the state after every step, the result and the phases; report the first
    /// step that differs.
    #[arg(long)]
    verify: bool,
    /// For the first phase that was not reached, report which parts of its conditions held, when, and how
    /// close the others came.
    #[arg(long)]
    phases: bool,
    /// Video of one recording: FILE.webp, FILE.gif, or with ffmpeg installed FILE.mp4.
    #[arg(long, value_name = "FILE")]
    video: Option<PathBuf>,
    /// Camera of the video: `third_person`, or a robot's name.
    #[arg(long, value_name = "CAMERA", default_value = "third_person")]
    camera: String,
    /// Folder for the images and depth of every camera; several recordings have a subfolder each. An
    /// interrupted run is continued.
    #[arg(long, value_name = "DIR")]
    render: Option<PathBuf>,
    /// Moving geometry of one recording for other renderers: FILE.glb (glTF, for example for Blender), or
    /// FILE.usda (USD, for example for Isaac Sim) with a folder of its images beside it.
    #[arg(long, value_name = "FILE")]
    export: Option<PathBuf>,
    /// Images or moments per second of simulated time.
    #[arg(long, value_name = "HZ", default_value_t = 25, value_parser = clap::value_parser!(u32).range(1..=50))]
    rate: u32,
    /// Duration of the video in seconds, for example 4 for a film that plays faster than a long episode
    /// [default: the episode's].
    #[arg(long, value_name = "S", requires = "video", value_parser = clap::value_parser!(u32).range(1..=3600))]
    seconds: Option<u32>,
    /// Size of the images, for example 640x480 [default: the camera's own].
    #[arg(long, value_name = "WIDTHxHEIGHT")]
    size: Option<SizeFlag>,
    /// Cameras of --render, separated by commas: third_person or robots' names [default: all].
    #[arg(long, value_name = "CAMERAS", value_delimiter = ',', requires = "render")]
    cameras: Vec<String>,
    /// With --render: write only images, in half the time.
    #[arg(long, requires = "render")]
    no_depth: bool,
    /// Renderer for --render [default: that of the episode].
    #[arg(long, value_name = "NAME", requires = "render", value_parser = one_of(RendererKind::ALL, RendererKind::name))]
    renderer: Option<RendererKind>,
    /// Model of the head cameras for --render [default: that of the episode].
    #[arg(long, value_name = "NAME", requires = "render", value_parser = one_of(CameraModel::ALL, CameraModel::name))]
    camera_model: Option<CameraModel>,
    /// Number of rendering threads.
    #[arg(long, default_value_t = 1, value_name = "N")]
    jobs: usize,
}

/// A size given on the command line.
#[derive(Clone, Copy, Debug)]
struct SizeFlag(PictureSize);

impl FromStr for SizeFlag {
    type Err = String;

    fn from_str(text: &str) -> Result<SizeFlag, String> {
        const SIDES_PX: std::ops::RangeInclusive<u32> = 16..=3840;
        let side = |text: &str| text.parse().ok().filter(|side| SIDES_PX.contains(side));
        let sides = text.split_once('x').and_then(|(width, height)| Some((side(width)?, side(height)?)));
        let (width, height) = sides.ok_or(format!(
            "no size; give width and height in pixels, each {} to {}, for example 640x480",
            SIDES_PX.start(),
            SIDES_PX.end()
        ))?;
        Ok(SizeFlag(PictureSize { width, height }))
    }
}

/// Processes each recording as the flags say. Without any flag, prints its contents.
pub fn run(args: ReplayArgs) -> CommandResult {
    if args.video.is_some() && args.recordings.len() > 1 {
        return Err("--video films one recording; give one".into());
    }
    if args.export.is_some() && args.recordings.len() > 1 {
        return Err("--export writes one recording; give one".into());
    }
    let mut all_same = true;
    for path in &args.recordings {
        if path.extension().is_some_and(|extension| extension == "checkpoint") {
            all_same &= failed_step(path, &args)?;
            continue;
        }
        let recording = Recording::read(path)?;
        describe(&recording);
        if args.phases {
            print!("{}", phases::told(&recording)?);
        }
        if args.verify {
            all_same &= print_verified(&verify(&recording)?);
        }
        let size = args.size.map(|SizeFlag(size)| size);
        if let Some(video) = &args.video {
            let view = EpisodeCamera::find(&args.camera, &recording.spec.task)?;
            let plan = FilmPlan { view, size, rate_hz: args.rate, duration_s: args.seconds };
            let pictures = film(&recording, &plan, video)?;
            let pace =
                args.seconds.map_or_else(|| format!("{} a second", args.rate), |s| format!("in {s} s"));
            println!("  {}: {pictures} pictures, {pace}", video.display());
        }
        if let Some(file) = &args.export {
            let moments = export(&recording, args.rate, file)?;
            println!("  {}: {moments} moments, {} a second", file.display(), args.rate);
        }
        if let Some(folder) = &args.render {
            let plan = PicturesPlan {
                rate_hz: args.rate,
                size,
                jobs: args.jobs,
                cameras: args.cameras.clone(),
                depth: !args.no_depth,
                renderer: args.renderer,
                camera: args.camera_model,
            };
            render(&recording, &plan, &folder_for(folder, path, args.recordings.len()))?;
        }
    }
    Ok(if all_same { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Reports the step in which the simulator failed. With `--verify`, repeats that step and returns true if
/// it fails in the same way.
fn failed_step(path: &Path, args: &ReplayArgs) -> Result<bool, Box<dyn std::error::Error>> {
    if args.video.is_some() || args.render.is_some() || args.export.is_some() {
        return Err(format!(
            "{} holds one step, without pictures; give the recording beside it",
            path.display()
        )
        .into());
    }
    let checkpoint = Checkpoint::read(path)?;
    let Some(failed) = checkpoint.failed() else {
        return Err(
            format!("{} is of no step that failed; {FAILED_STEP_FILE} would be", path.display()).into()
        );
    };
    let spec = checkpoint.spec();
    let (task, seed, protocol) = (&spec.task.id, spec.seed, spec.protocol);
    println!("{}: {task} seed {seed}, {protocol}", path.display());
    println!("  the simulator failed {}", printable(&failed.failure));
    if !args.verify {
        return Ok(true);
    }
    let again = Session::fail_again(&checkpoint, failed)?;
    let text = again.map_or("the step succeeds".into(), |diverged| diverged.to_string());
    let same = failed.failure.ends_with(&text);
    println!("  {}: {text}", if same { "verified, it fails again" } else { "DIFFERS, again" });
    Ok(same)
}

fn describe(recording: &Recording) {
    let spec = &recording.spec;
    let (task, seed, protocol) = (&spec.task.id, spec.seed, spec.protocol);
    let (task, build) = (printable(task), printable(&recording.build));
    println!("{}: {task} seed {seed}, {protocol}, build {build}", recording.path().display());
    println!("  {}", printable(&told(spec, recording.result.as_ref())));
    match &recording.result {
        Some(result) => {
            let reached = result.phases.0.iter().filter(|(_, time_s)| time_s.is_some()).count();
            println!(
                "  {reached} of {} phases, {} steps, {} calls, {} falls",
                result.phases.0.len(),
                result.env_steps,
                result.tool_calls,
                result.falls
            );
        }
        None => println!("  interrupted before its end"),
    }
    if !recording.uncovered().is_empty() {
        println!("  warning: no checksum covers {}", recording.uncovered().join(", "));
    }
}

/// Lists the assistance of the policy, and deviations from Tandem's defaults.
fn told(spec: &EpisodeSpec, result: Option<&ResultReply>) -> String {
    let shown = result.map_or(&[][..], |result| &result.extra_information[..]);
    let assistance = format!("assistance: {}", spec.assistance);
    let peculiarities = spec.peculiarities().into_iter().filter(|what| *what != assistance);
    let besides = peculiarities.chain(shown.iter().map(|what| format!("shown {what}")));
    [assistance.clone()].into_iter().chain(besides).collect::<Vec<_>>().join(", ")
}

/// Prints the result of the comparison. Returns true if replay and recording are the same.
fn print_verified(verified: &Verification) -> bool {
    if let Some(build) = &verified.other_build {
        println!(
            "  warning: {build} recorded it, and builds may differ in their physics; a difference may be theirs"
        );
    }
    let Verification { steps, calls, unanswered_steps, .. } = verified;
    match &verified.outcome {
        Verdict::Same => {
            println!("  verified: {steps} states over {calls} calls, result and phases are as recorded");
            if *unanswered_steps > 0 {
                println!(
                    "  the last {unanswered_steps} steps belong to a call that was not answered any more"
                );
            }
            true
        }
        Verdict::State(Difference { control_step, recorded, again, call }) => {
            let hash = |hash: &Option<String>| hash.clone().unwrap_or("no such step".into());
            let by = match call {
                Some((number, tool)) => format!("in call {number}, {tool}"),
                None => "before the first call".into(),
            };
            let (recorded, again) = (hash(recorded), hash(again));
            println!("  DIFFERS at step {control_step}, {by}: recorded {recorded}, again {again}");
            println!("  {steps} states before it are as recorded");
            false
        }
        Verdict::Result { what, recorded, again } => {
            println!(
                "  DIFFERS: {what}: recorded {recorded}, again {again}; all {steps} states are as recorded"
            );
            false
        }
    }
}

/// Returns the folder for the images of one recording. With several recordings, each has a subfolder with the
/// name of its episode's folder.
fn folder_for(folder: &Path, recording: &Path, recordings: usize) -> PathBuf {
    let own = recording.parent().and_then(Path::file_name);
    match (recordings, own) {
        (0 | 1, _) | (_, None) => folder.into(),
        (_, Some(name)) => folder.join(name),
    }
}

fn render(
    recording: &Recording,
    plan: &PicturesPlan,
    folder: &Path,
) -> Result<(), Box<dyn std::error::Error>> {
    let bar = ProgressBar::no_length();
    bar.set_style(ProgressStyle::with_template("  {pos} moments, {elapsed}")?);
    let DrawnPictures { moments, already_drawn, cameras } =
        draw_all(recording, plan, folder, &|| bar.inc(1))?;
    bar.finish_and_clear();
    println!("  {}: {moments} moments of {cameras} cameras, {already_drawn} of them kept", folder.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use tandem_episodes::{RobotFile, tasks};
    use tandem_tools_spec::{Assistance, Hints, MoveWrists, Protocol, WristMove};

    use super::*;
    use crate::hosting::write_absurd_robot;

    fn args(path: &Path) -> ReplayArgs {
        ReplayArgs {
            recordings: vec![path.into()],
            verify: true,
            phases: false,
            video: None,
            camera: "third_person".into(),
            render: None,
            export: None,
            rate: 25,
            seconds: None,
            size: None,
            jobs: 1,
            cameras: vec![],
            no_depth: false,
            renderer: None,
            camera_model: None,
        }
    }

    fn play_until_the_simulator_fails(folder: &Path) -> Session {
        let robot = folder.join("absurd.xml");
        write_absurd_robot(&robot);
        let handover = tasks::find("handover").unwrap();
        let spec = EpisodeSpec {
            robot: RobotFile::of(&robot).unwrap(),
            ..EpisodeSpec::new(&handover, 0, Protocol::Benchmark)
        };
        let mut session = Session::start(&spec, Some(folder)).unwrap();
        let reach = WristMove { right_position_m: Some([0.28, -0.24, 0.22]), ..WristMove::hold("A") };
        session.call(MoveWrists { steps: 5, robots: vec![reach] }.into()).unwrap_err();
        session
    }

    #[test]
    fn what_policies_were_told_is_said() {
        let own = EpisodeSpec::new(&tasks::find("handover").unwrap(), 0, Protocol::Benchmark);
        assert_eq!(told(&own, None), "assistance: full");
        let paper = EpisodeSpec { hints: Hints::On, ..own.assisted(Assistance::Paper) };
        assert_eq!(told(&paper, None), "assistance: paper, hints: on");
    }

    #[test]
    fn a_step_that_failed_is_made_again_from_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let session = play_until_the_simulator_fails(folder.path());
        let path = folder.path().join(FAILED_STEP_FILE);
        assert!(failed_step(&path, &args(&path)).unwrap(), "it fails as it did");
        let filmed = ReplayArgs { video: Some("film.webp".into()), ..args(&path) };
        let refused = failed_step(&path, &filmed).unwrap_err().to_string();
        assert!(refused.contains("give the recording beside it"), "{refused}");

        let sound = folder.path().join("sound.checkpoint");
        session.checkpoint().unwrap().write(&sound).unwrap();
        let refused = failed_step(&sound, &args(&sound)).unwrap_err().to_string();
        assert!(refused.contains("no step that failed"), "{refused}");
        session.close();
    }
}
