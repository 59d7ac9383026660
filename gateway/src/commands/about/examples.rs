//! `tandem examples`: the files of `gateway/examples`, for users without a checkout.

use std::{fs, io, path::Path, process::ExitCode};

use crate::commands::CommandResult;

/// Write the examples of the book (agents, tasks, robots, servers, environments) into gateway/examples of the
/// working folder, where the book's commands find them. Existing files are kept.
#[derive(Debug, clap::Args)]
pub struct ExamplesArgs {}

/// Folder of the examples, in the working folder and in the repository.
const FOLDER: &str = "gateway/examples";

macro_rules! examples {
    ($($path:literal)*) => { [$(($path, include_str!(concat!("../../../examples/", $path)))),*] };
}

/// All examples: the path in the folder, and the text.
const EXAMPLES: [(&str, &str); 36] = examples! {
    "agents/agent.py"
    "agents/claude.sh"
    "agents/codex.sh"
    "agents/words.py"
    "bridges/gr00t_zmq.py"
    "environments/env.py"
    "environments/reach_and_grasp.py"
    "environments/reach_and_grasp.txt"
    "environments/rollouts.py"
    "replicas/haproxy.cfg"
    "replicas/kubernetes.yaml"
    "robots/apptronik_apollo.toml"
    "robots/booster_t1.toml"
    "robots/fourier_gr1.toml"
    "robots/g1_rubber_hands.toml"
    "robots/unitree_g1.toml"
    "robots/unitree_g1_dex3.toml"
    "robots/unitree_h1.toml"
    "robots/unitree_h1_2.toml"
    "robots/walker.toml"
    "robots/walker.xml"
    "servers/lerobot_act.py"
    "tasks/house/drawer.xml"
    "tasks/house/meshes/kitchen_chest_carcass.obj"
    "tasks/house/meshes/kitchen_chest_drawer.obj"
    "tasks/house/meshes/kitchen_table.obj"
    "tasks/house/meshes/kitchen_tin.obj"
    "tasks/house/meshes/kitchen_tray.obj"
    "tasks/house/meshes/living_table.obj"
    "tasks/house/scene.xml"
    "tasks/house/tray.xml"
    "tasks/into_the_drawer.toml"
    "tasks/pass_the_parcel.toml"
    "tasks/tray_to_the_living_room.toml"
    "training/openpi_config.py"
    "training/openpi_map.toml"
};

/// Writes the examples below the working folder.
pub fn run(ExamplesArgs {}: ExamplesArgs) -> CommandResult {
    let folder = Path::new(FOLDER);
    let written = write(folder).map_err(|error| format!("{FOLDER}: {error}; run it in another folder"))?;
    println!("{FOLDER}: {written} files written, {} kept", EXAMPLES.len() - written);
    Ok(ExitCode::SUCCESS)
}

/// Writes the examples that are not in `folder` yet, and returns their number.
fn write(folder: &Path) -> io::Result<usize> {
    let mut written = 0;
    for (path, text) in EXAMPLES {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().unwrap_or(folder))?;
        match fs::File::create_new(&path) {
            Ok(mut file) => io::Write::write_all(&mut file, text.as_bytes())?,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
            Err(error) => return Err(error),
        }
        #[cfg(unix)]
        if text.starts_with("#!") {
            fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o755))?;
        }
        written += 1;
    }
    Ok(written)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Returns the paths of all files below a folder, relative to it.
    fn files(folder: &Path) -> BTreeSet<String> {
        let mut found = BTreeSet::new();
        for entry in fs::read_dir(folder).expect("a folder").flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            match entry.path().is_dir() {
                true if name == "__pycache__" => {}
                true => found.extend(files(&entry.path()).into_iter().map(|path| format!("{name}/{path}"))),
                false => drop(found.insert(name)),
            }
        }
        found
    }

    #[test]
    fn every_example_of_the_repository_is_written_and_none_twice() {
        let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(write(folder.path()).expect("room"), EXAMPLES.len());
        assert_eq!(files(folder.path()), files(&own));
        let edited = folder.path().join("agents/agent.py");
        fs::write(&edited, "mine").expect("room");
        assert_eq!(write(folder.path()).expect("room"), 0);
        assert_eq!(fs::read_to_string(edited).expect("a file"), "mine");
    }
}
