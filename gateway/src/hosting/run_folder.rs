//! One folder per episode in the runs folder. The folder's name is the episode's id.

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU32, Ordering},
    },
};

use tandem_episodes::{EpisodeSpec, create_new_private_folder, create_private_folder};

use crate::token::{Token, TokenError};

/// Checks that the runs folder is writable by writing and removing a probe file. Creates the folder if
/// necessary and keeps it.
///
/// # Errors
///
/// Returns a message that says how to make the folder usable.
pub fn try_runs_folder(runs: &Path) -> Result<(), String> {
    let probe = runs.join(format!(".probe-{}", std::process::id()));
    let tried = create_private_folder(runs).and_then(|()| fs::write(&probe, "probe"));
    let cleared = fs::remove_file(&probe);
    let shown = runs.display();
    tried.and(cleared).map_err(|error| {
        format!("{shown}: {error}; make room there, make it writable, or give another --runs")
    })
}

/// Does the same as [`try_runs_folder`], but removes the folders that it has created.
pub fn look_at_runs_folder(runs: &Path) -> Result<(), String> {
    let named = runs.ancestors().filter(|path| !path.as_os_str().is_empty());
    let missing: Vec<&Path> = named.take_while(|path| !path.exists()).collect();
    let tried = try_runs_folder(runs);
    // Folders created for the check are removed unless they are no longer empty.
    let _ = missing.into_iter().try_for_each(fs::remove_dir);
    tried
}

/// Returns the public name of an episode: its task and its seed. A random text replaces a hidden seed.
pub fn episode_name(spec: &EpisodeSpec) -> Result<String, TokenError> {
    let task = &spec.task.id;
    Ok(match spec.told_seed() {
        Some(seed) => format!("{task}-seed{seed}"),
        None => format!("{task}-{}", &Token::random()?.1[..RANDOM_NAME_CHARS]),
    })
}

/// Length of the random part of a name.
const RANDOM_NAME_CHARS: usize = 10;

/// Names and creates the folders of one server.
#[derive(Debug, Default)]
pub struct RunFolders {
    /// Names of episodes for which a folder was created. The folder may have been removed since, for example
    /// if no file could be written to it.
    given: Mutex<BTreeSet<String>>,
    /// Number of episodes for which no folder could be created.
    without: AtomicU32,
}

impl RunFolders {
    /// Creates a new folder for an episode called `base`: `handover-seed0`, or `handover-seed0-2`, `-3`,
    /// ... if the name is taken.
    ///
    /// If no folder can be created, for example on a full disk, the episode still gets a name. Its
    /// recording then fails with the reason.
    pub fn create(&self, runs: &Path, base: &str) -> (String, PathBuf) {
        if let Ok(Some(made)) = create_private_folder(runs).and_then(|()| self.first_free(runs, base)) {
            return made;
        }
        loop {
            let number = self.without.fetch_add(1, Ordering::Relaxed) + 1;
            let name = format!("{base}-unrecorded-{number}");
            let folder = runs.join(&name);
            if !folder.exists() {
                return (name, folder);
            }
        }
    }

    fn first_free(&self, runs: &Path, base: &str) -> io::Result<Option<(String, PathBuf)>> {
        let mut given = self.given.lock().unwrap_or_else(PoisonError::into_inner);
        let names = std::iter::once(base.to_owned()).chain((2u32..).map(|n| format!("{base}-{n}")));
        for name in names {
            if given.contains(&name) {
                continue;
            }
            let folder = runs.join(&name);
            match create_new_private_folder(&folder) {
                Ok(()) => {
                    given.insert(name.clone());
                    return Ok(Some((name, folder)));
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::RunFolders;

    #[test]
    fn names_are_never_used_twice() {
        let runs = std::env::temp_dir().join(format!("tandem-runs-{}", std::process::id()));
        let folders = RunFolders::default();
        let name = |seed| folders.create(&runs, &format!("handover-seed{seed}")).0;
        assert_eq!(
            [name(0), name(0), name(1), name(0)],
            ["handover-seed0", "handover-seed0-2", "handover-seed1", "handover-seed0-3"]
        );
        std::fs::remove_dir(runs.join("handover-seed0")).unwrap();
        assert_eq!(
            name(0),
            "handover-seed0-4",
            "the episode may still be held when its empty folder is gone"
        );
        std::fs::remove_dir_all(&runs).unwrap();
    }

    #[test]
    fn an_episode_has_a_name_of_its_own_where_no_folder_can_be_made() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let folders = RunFolders::default();
        let names = [(); 2].map(|()| folders.create(&file.path().join("runs"), "handover-seed0").0);
        assert_eq!(names, ["handover-seed0-unrecorded-1", "handover-seed0-unrecorded-2"]);
    }

    #[cfg(unix)]
    #[test]
    fn nobody_but_the_owner_looks_into_runs() {
        use std::os::unix::fs::PermissionsExt;
        let parent = tempfile::tempdir().unwrap();
        let runs = parent.path().join("data/runs");
        let (_, folder) = RunFolders::default().create(&runs, "handover-seed0");
        for path in [runs, folder] {
            let mode = std::fs::metadata(&path).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o700, "{}", path.display());
        }
    }
}
