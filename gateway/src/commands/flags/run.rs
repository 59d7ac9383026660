//! The flags for the folder of a run, and for the treatment of an existing one.

use std::path::{Path, PathBuf};

use clap::Args;
use tandem_evaluation::evaluation::{EvaluationPlan, ExistingRun, default_folder};

/// Parent folder of the folders of runs.
const RUNS: &str = "runs";

/// The folder of a run.
#[derive(Debug, Args)]
pub struct RunFlags {
    /// Folder of the run, for `results.json` and one file per episode [default: a folder in runs that is
    /// named after the policy, the protocol and all other settings of the run].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Continue a run of another build of the program: its episodes are kept and marked, and only the missing
    /// ones are played.
    #[arg(long)]
    resume_with_new_build: bool,
    /// Delete an existing run in the folder and start over.
    #[arg(long, conflicts_with = "resume_with_new_build")]
    overwrite: bool,
}

impl RunFlags {
    /// Returns the treatment of an existing run in the folder.
    pub fn existing(&self) -> ExistingRun {
        match (self.overwrite, self.resume_with_new_build) {
            (true, _) => ExistingRun::Overwrite,
            (false, true) => ExistingRun::ResumeWithNewBuild,
            (false, false) => ExistingRun::Refuse,
        }
    }

    /// Returns the folder for `plan`. Its default name contains `name`, or else the name of the policy.
    pub fn folder(&self, plan: &EvaluationPlan, name: Option<&str>) -> PathBuf {
        self.out.clone().unwrap_or_else(|| default_folder(plan, name, Path::new(RUNS)))
    }
}
