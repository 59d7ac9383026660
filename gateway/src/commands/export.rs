//! `tandem export`: data sets and logs from recordings, which the Python package writes.

use std::{path::PathBuf, process::ExitCode};

use clap::Subcommand;
use tandem_episodes::{CameraModel, RendererKind};

use super::CommandResult;
use crate::drivers::{PythonModule, PythonPart};
use crate::settings::one_of;

/// Convert recordings to data sets for training policies, and agents' conversations to logs. This needs the
/// Python package: pip install 'tandem-sim[lerobot]' or 'tandem-sim[inspect]' (in a checkout
/// './gateway/python[lerobot]').
#[allow(
    rustdoc::broken_intra_doc_links,
    reason = "the command line's help names an extra of the wheel, and no link"
)]
#[derive(Debug, clap::Args)]
pub struct ExportArgs {
    #[command(subcommand)]
    format: ExportFormat,
}

/// Formats of data sets and logs.
#[derive(Debug, Subcommand)]
enum ExportFormat {
    Lerobot(Box<LerobotArgs>),
    Inspect(InspectArgs),
}

/// Write logs of Inspect (inspect-ai), one per task and set of models, with each message, image, call and
/// score. Episodes of agents without a conversation file have the calls of their recording.
#[derive(Debug, clap::Args)]
struct InspectArgs {
    /// An episode's folder, or a folder to search for episodes.
    #[arg(value_name = "RUNS")]
    runs: PathBuf,
    /// Folder of the logs.
    #[arg(value_name = "OUT")]
    out: PathBuf,
}

/// Write a LeRobot data set. An interrupted run is continued, and OUT appears once it is complete; several
/// tasks become one data set each in OUT.
#[derive(Debug, clap::Args)]
struct LerobotArgs {
    /// A recording, or a folder to search for recordings.
    #[arg(value_name = "RUNS")]
    runs: PathBuf,
    /// Folder of the data set.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Version of LeRobot's format.
    #[arg(long, value_name = "VERSION", default_value = "v3", value_parser = ["v3", "v2"])]
    format: String,
    /// One episode per recording with all robots' columns, or one per robot with its own columns.
    #[arg(long, value_name = "VIEW", default_value = "joint", value_parser = ["joint", "robot"])]
    view: String,
    /// Cameras: `egocentric` (the head cameras of all robots), `third_person` or robots' names, separated by
    /// commas; or `none`.
    #[arg(long, value_name = "CAMERAS", default_value = "egocentric")]
    cameras: String,
    /// Images as videos, or as PNG files in the tables.
    #[arg(long, value_name = "KIND", default_value = "video", value_parser = ["video", "png"])]
    images: String,
    /// Video codec: H.264, which is faster to write and read, or AV1, which LeRobot itself uses.
    #[arg(long, value_name = "CODEC", default_value = "h264", value_parser = ["h264", "av1"])]
    codec: String,
    /// Write depth beside the images in the format of LeRobot 0.6 or later: 12-bit HEVC videos, or TIFF files
    /// in the tables.
    #[arg(long)]
    depth: bool,
    /// Size of the images.
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "320x240")]
    size: String,
    /// Rows per second.
    #[arg(long, value_name = "HZ", default_value = "10", value_parser = ["50", "25", "10"])]
    rate: String,
    /// Renderer of the images [default: that of the episode].
    #[arg(long, value_name = "NAME", value_parser = one_of(RendererKind::ALL, RendererKind::name))]
    renderer: Option<RendererKind>,
    /// Model of the head cameras [default: that of the episode].
    #[arg(long, value_name = "NAME", value_parser = one_of(CameraModel::ALL, CameraModel::name))]
    camera_model: Option<CameraModel>,
    /// Licence of the data set for its card, by the name that the Hugging Face Hub uses, for example
    /// cc-by-4.0 [default: none, so all rights stay with you].
    #[arg(long, value_name = "NAME")]
    license: Option<String>,
    /// Convert only episodes that reached their last phase.
    #[arg(long)]
    only_successful: bool,
    /// Convert only episodes with a file `good` in their folder.
    #[arg(long)]
    only_good: bool,
    /// Number of recordings to convert in parallel [default: the machine's cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
}

impl LerobotArgs {
    /// Returns the arguments for Python, which has the same flags.
    fn arguments(&self) -> Vec<String> {
        let LerobotArgs { runs, out, format, view, cameras, images, codec, size, rate, .. } = self;
        let texts = [
            ("format", format),
            ("view", view),
            ("cameras", cameras),
            ("images", images),
            ("codec", codec),
            ("size", size),
            ("rate", rate),
        ];
        let texts = texts.into_iter().map(|(flag, value)| format!("--{flag}={value}"));
        let switches = [
            (self.depth, "--depth"),
            (self.only_successful, "--only-successful"),
            (self.only_good, "--only-good"),
        ];
        let switches = switches.into_iter().filter(|(given, _)| *given).map(|(_, flag)| flag.into());
        let jobs = self.jobs.map(|jobs| format!("--jobs={jobs}"));
        let renderer = self.renderer.map(|kind| format!("--renderer={}", kind.name()));
        let camera = self.camera_model.map(|model| format!("--camera-model={}", model.name()));
        let license = self.license.as_ref().map(|name| format!("--license={name}"));
        let paths = [runs, out].map(|path| path.display().to_string());
        let given = texts.chain(switches).chain(renderer).chain(camera).chain(license).chain(jobs);
        ["lerobot".into()].into_iter().chain(given).chain(["--".into()]).chain(paths).collect()
    }
}

impl InspectArgs {
    /// Returns the arguments for Python.
    fn arguments(&self) -> Vec<String> {
        let paths = [&self.runs, &self.out].map(|path| path.display().to_string());
        ["inspect".into(), "--".into()].into_iter().chain(paths).collect()
    }
}

/// Lets Python write the data set or the logs.
pub fn run(args: ExportArgs) -> CommandResult {
    let module = match args.format {
        ExportFormat::Lerobot(args) => PythonModule::new(PythonPart::Export, args.arguments()),
        ExportFormat::Inspect(args) => PythonModule::new(PythonPart::Inspect, args.arguments()),
    }?;
    let status = module.command(&[]).status()?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
