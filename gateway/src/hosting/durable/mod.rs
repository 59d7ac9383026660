//! Journals and leases of episodes that outlive the server process.
//!
//! Each episode has a journal in the runs folder, to which every call is written before its answer is sent.
//! Each also has a lease that names the server that plays it. A server that takes over the lease replays the
//! journal.

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

/// Folder of journals in the runs folder. No run has a name that begins with a dot.
const LIVE_FOLDER: &str = ".live";
const JOURNAL_EXTENSION: &str = "jsonl";

/// Journals of the servers that share a runs folder.
#[derive(Debug, Clone)]
pub struct LiveFolder {
    path: PathBuf,
    /// URL at which the other servers reach this one.
    pub url: String,
    pub durability: Durability,
}

impl LiveFolder {
    /// Describes the journals in the runs folder `runs` for a server that is reachable at `url`.
    pub fn beside(runs: &Path, url: String, durability: Durability) -> LiveFolder {
        LiveFolder { path: runs.join(LIVE_FOLDER), url, durability }
    }

    /// Creates the folder if it does not exist.
    pub fn create(&self) -> io::Result<()> {
        create_private_folder(&self.path)
    }

    /// Returns the path of the journal of the episode `id`; `None` for an id that is not a plain name.
    pub fn journal(&self, id: &str) -> Option<PathBuf> {
        let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
        let plain = !id.is_empty() && !id.starts_with('.') && id.bytes().all(is_plain);
        plain.then(|| self.path.join(format!("{id}.{JOURNAL_EXTENSION}")))
    }

    /// Lists the ids of all episodes that have a journal, in order.
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

/// Returns the time since a file was written.
fn age(path: &Path) -> io::Result<Duration> {
    // A modification time in the future comes from a clock that is ahead.
    Ok(fs::metadata(path)?.modified()?.elapsed().unwrap_or_default())
}
