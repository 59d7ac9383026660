//! `tandem import`: files of other programs, which the Python package converts to MJCF that Tandem reads.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use tandem_episodes::{SIDES_FILE, draw_sides};

use super::CommandResult;
use crate::drivers::{PythonModule, PythonPart};

/// Files that an import writes, one per source.
const WRITTEN: [&str; 2] = ["scene.xml", "object.xml"];

/// Convert scenes, objects and robots of other programs to MJCF that Tandem reads, each with a report and a
/// picture from four sides. This needs the Python package: pip install 'tandem-sim[import]' (in a checkout
/// './gateway/python[import]').
#[allow(
    rustdoc::broken_intra_doc_links,
    reason = "the command line's help names an extra of the wheel, and no link"
)]
#[derive(Debug, clap::Args)]
pub struct ImportArgs {
    /// Files: MJCF, URDF, SDF, Drake's directives (.dmd.yaml), or meshes as OBJ, STL, PLY, GLB or glTF.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Folder to write; each of several files gets a folder in it.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Let concave meshes collide as convex pieces instead of as their convex hulls. CoACD cuts them if it is
    /// installed, otherwise V-HACD.
    #[arg(long)]
    decompose: bool,
}

/// Lets Python write the files, and renders a picture of each.
pub fn run(args: ImportArgs) -> CommandResult {
    let words = args.files.iter().chain([&args.out]).map(|path| path.to_string_lossy().into_owned());
    let words = words.chain(args.decompose.then(|| "--decompose".into())).collect();
    let status = PythonModule::new(PythonPart::Import, words)?.command(&[]).status()?;
    let mut all_drawn = true;
    for file in &args.files {
        let folder = match args.files.len() {
            1 => args.out.clone(),
            _ => args.out.join(file.file_stem().unwrap_or_default()),
        };
        let written = WRITTEN.into_iter().map(|name| folder.join(name)).find(|path| path.is_file());
        all_drawn &= written.is_none_or(|written| draw(&written, &folder.join(SIDES_FILE)));
    }
    Ok(if status.success() && all_drawn { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Renders a scene from four sides. Returns false if the scene is refused, and prints the reason.
fn draw(scene: &Path, picture: &Path) -> bool {
    let drawn = draw_sides(scene).map_err(|error| error.to_string());
    let written = drawn.and_then(|png| std::fs::write(picture, png).map_err(|error| error.to_string()));
    match &written {
        Ok(()) => println!("{} shows it from four sides", picture.display()),
        Err(error) => eprintln!("{}: {error}", scene.display()),
    }
    written.is_ok()
}
