//! Episodes that outlive the process which holds them: each has a journal beside the runs, in which every call
//! is written before its answer leaves, and a lease that says which server plays it. Whoever takes the lease
//! plays the journal again.

mod journal_file;
mod lease;

pub use journal_file::{Commit, Heading, JournalFile, JournalReader, KeptAnswer, Keyed, KeyedNote, StartKey};
pub use lease::{Lease, Leasing};

use std::{
    fs, io,
    path::{Path, PathBuf},
    time::Duration,
};

use tandem_episodes::create_private_folder;

use crate::settings::Durability;

/// The folder of journals in the folder of runs. What begins with a dot is no run.
const LIVE_FOLDER: &str = ".live";
const JOURNAL_EXTENSION: &str = "jsonl";

/// The journals of the servers that share a folder of runs.
#[derive(Debug, Clone)]
pub struct LiveFolder {
    path: PathBuf,
    /// Where the others find this server.
    pub url: String,
    pub durability: Durability,
}

impl LiveFolder {
    /// The journals beside `runs`, for a server that is reached at `url`.
    pub fn beside(runs: &Path, url: String, durability: Durability) -> LiveFolder {
        LiveFolder { path: runs.join(LIVE_FOLDER), url, durability }
    }

    /// Makes the folder, where it is not there.
    pub fn create(&self) -> io::Result<()> {
        create_private_folder(&self.path)
    }

    /// The journal of the episode `id`. An id that is no plain name has none.
    pub fn journal(&self, id: &str) -> Option<PathBuf> {
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
        let plain = !id.is_empty() && !id.starts_with('.') && id.bytes().all(is_plain);
        plain.then(|| self.path.join(format!("{id}.{JOURNAL_EXTENSION}")))
    }

    /// The ids of all episodes that have a journal, in order.
    pub fn ids(&self) -> Vec<String> {
        let Ok(entries) = fs::read_dir(&self.path) else { return Vec::new() };
        let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
        let journals = paths.filter(|path| path.extension().is_some_and(|have| have == JOURNAL_EXTENSION));
        let mut ids: Vec<String> =
            journals.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned())).collect();
        ids.sort_unstable();
        ids
    }
}

/// How long ago a file was written.
fn age(path: &Path) -> io::Result<Duration> {
    // One of the future has been written by a clock that is ahead.
    Ok(fs::metadata(path)?.modified()?.elapsed().unwrap_or_default())
}
