//! `tandem export`: data sets from recordings, which the Python package writes.

use std::{path::PathBuf, process::ExitCode};

use clap::Subcommand;

use super::CommandResult;
use crate::drivers::{PythonModule, PythonPart};

/// Make data sets of recordings, for those who train policies. Python writes them: pip install
/// './gateway/python[lerobot]' in a checkout of the repository.
#[allow(
    rustdoc::broken_intra_doc_links,
    reason = "the command line's help names an extra of the wheel, and no link"
)]
#[derive(Debug, clap::Args)]
pub struct ExportArgs {
    #[command(subcommand)]
    format: ExportFormat,
}

/// The formats.
#[derive(Debug, Subcommand)]
enum ExportFormat {
    Lerobot(LerobotArgs),
}

/// Write what LeRobot reads. What an interrupted run has done is kept, and OUT is there once it is whole; of several tasks, a data
/// set for each in OUT.
#[derive(Debug, clap::Args)]
struct LerobotArgs {
    /// A recording, or a folder that is searched for them.
    #[arg(value_name = "RUNS")]
    runs: PathBuf,
    /// Folder of the data set.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Version of LeRobot's format.
    #[arg(long, value_name = "VERSION", default_value = "v3", value_parser = ["v3", "v2"])]
    format: String,
    /// An episode for each recording, with all robots' columns, or one for each robot of it, with its own.
    #[arg(long, value_name = "VIEW", default_value = "joint", value_parser = ["joint", "robot"])]
    view: String,
    /// What sees: `egocentric` (the cameras of all robots' heads), `third_person`, robots' names, separated by commas; or `none`.
    #[arg(long, value_name = "CAMERAS", default_value = "egocentric")]
    cameras: String,
    /// Pictures as films, or as PNG files within the tables.
    #[arg(long, value_name = "KIND", default_value = "video", value_parser = ["video", "png"])]
    images: String,
    /// What films are written with: H.264, which is written and read faster, or AV1, as LeRobot writes them itself.
    #[arg(long, value_name = "CODEC", default_value = "h264", value_parser = ["h264", "av1"])]
    codec: String,
    /// Depth beside the pictures, as LeRobot stores it since 0.6: films of 12 bits in HEVC, or TIFF files within the tables.
    #[arg(long)]
    depth: bool,
    /// Size of the pictures.
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "320x240")]
    size: String,
    /// Rows a second.
    #[arg(long, value_name = "HZ", default_value = "10", value_parser = ["50", "25", "10"])]
    rate: String,
    /// Only episodes that reached their last phase.
    #[arg(long)]
    only_successful: bool,
    /// Only episodes in whose folder a file `good` lies.
    #[arg(long)]
    only_good: bool,
    /// Recordings that are read and drawn side by side [default: the machine's cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
}

impl LerobotArgs {
    /// Returns the arguments for Python, whose flags are the same.
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
        let paths = [runs, out].map(|path| path.display().to_string());
        let given = texts.chain(switches).chain(jobs);
        ["lerobot".into()].into_iter().chain(given).chain(["--".into()]).chain(paths).collect()
    }
}

/// Lets Python write the data set.
pub fn run(args: ExportArgs) -> CommandResult {
    let ExportFormat::Lerobot(args) = args.format;
    let module = PythonModule::new(PythonPart::Export, args.arguments())?;
    let status = module.command(&[]).status()?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
