//! One folder per episode under the runs folder. The folder's name is the episode's id.

use std::{
    io,
    path::{Path, PathBuf},
};

use tandem_episodes::{create_new_private_folder, create_private_folder};

/// Makes a new folder for an episode: `handover-seed0`, and where that is taken `handover-seed0-2`, `-3`, ...
pub fn create(runs: &Path, task: &str, seed: u32) -> io::Result<(String, PathBuf)> {
    create_private_folder(runs)?;
    let base = format!("{task}-seed{seed}");
    let names = std::iter::once(base.clone()).chain((2u32..).map(|n| format!("{base}-{n}")));
    for name in names {
        let folder = runs.join(&name);
        match create_new_private_folder(&folder) {
            Ok(()) => return Ok((name, folder)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::other(format!("every name for {base} is taken in {}", runs.display())))
}

#[cfg(test)]
mod tests {
    #[test]
    fn names_are_never_used_twice() {
        let runs = std::env::temp_dir().join(format!("tandem-runs-{}", std::process::id()));
        let name = |seed| super::create(&runs, "handover", seed).unwrap().0;
        assert_eq!(
            [name(0), name(0), name(1), name(0)],
            ["handover-seed0", "handover-seed0-2", "handover-seed1", "handover-seed0-3"]
        );
        std::fs::remove_dir_all(&runs).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn nobody_but_the_owner_looks_into_runs() {
        use std::os::unix::fs::PermissionsExt;
        let parent = tempfile::tempdir().unwrap();
        let runs = parent.path().join("data/runs");
        let (_, folder) = super::create(&runs, "handover", 0).unwrap();
        for path in [runs, folder] {
            let mode = std::fs::metadata(&path).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o700, "{}", path.display());
        }
    }
}
