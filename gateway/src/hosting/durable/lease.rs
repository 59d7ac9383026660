//! Leases of episodes. The server that has locked an episode's lease file plays the episode.
//!
//! On a file system without locks, a lease is held for as long as its owner keeps renewing it.

use std::{
    fs::{self, File},
    io::{self, Read, Seek, Write},
    path::{Path, PathBuf},
    thread,
    time::{Duration, SystemTime},
};

use tandem_episodes::{FileLock, LockKind, Locking};

use super::age;

/// Age after which the owner of a lease counts as gone. Used only on file systems without locks.
const STALE: Duration = Duration::from_secs(30);

/// Number of attempts to take a lease that is held. A server that only checks the lease holds it for
/// microseconds.
const ATTEMPTS: u32 = 40;
const ATTEMPT_INTERVAL: Duration = Duration::from_millis(1);
/// Remaining attempts at or below which a lease with a readable owner counts as held.
const SURE_AFTER: u32 = ATTEMPTS - 3;

/// The right to play an episode, released when the value is dropped.
#[derive(Debug)]
pub struct Lease {
    path: PathBuf,
    /// `None` if the file system has no locks.
    lock: Option<FileLock>,
}

/// Outcome of an attempt to take a lease.
#[derive(Debug)]
pub enum Leasing {
    Taken(Lease),
    /// Another server, reachable at `url`, holds the lease.
    Held {
        /// URL of the owner; empty if the owner has not written it yet.
        url: String,
    },
}

impl Lease {
    /// Returns the path of the lease of the episode with this journal.
    fn path(journal: &Path) -> PathBuf {
        journal.with_extension("lease")
    }

    /// Takes the lease of the episode with this journal for the server at `url`, unless another server
    /// has it.
    pub fn take(journal: &Path, url: &str) -> io::Result<Leasing> {
        let path = Lease::path(journal);
        let mut attempts = ATTEMPTS;
        let lock = loop {
            attempts -= 1;
            match FileLock::attempt(&path, LockKind::Exclusive)? {
                Locking::Locked(lock) => break Some(lock.removing(&path)),
                // Another server may be reading the file at this moment, and a fresh lease may have no owner
                // yet.
                Locking::Held if attempts > 0 && (attempts > SURE_AFTER || owner(&path).is_empty()) => {
                    thread::sleep(ATTEMPT_INTERVAL);
                }
                Locking::Held => return Ok(Leasing::Held { url: owner(&path) }),
                Locking::Unsupported => match fresh_owner(&path).filter(|other| other != url) {
                    Some(url) => return Ok(Leasing::Held { url }),
                    None => break None,
                },
            }
        };
        match &lock {
            Some(lock) => write_owner(lock.file(), url)?,
            None => write_owner(&File::create(&path)?, url)?,
        }
        Ok(Leasing::Taken(Lease { path, lock }))
    }

    /// Returns true if a server other than the one at `url` has the lease of the episode with this
    /// journal.
    pub fn is_elsewhere(journal: &Path, url: &str) -> bool {
        let path = Lease::path(journal);
        if !path.exists() {
            return false;
        }
        match FileLock::attempt(&path, LockKind::Shared) {
            Ok(Locking::Held) => owner(&path) != url,
            Ok(Locking::Unsupported) => fresh_owner(&path).is_some_and(|other| other != url),
            Ok(Locking::Locked(_)) | Err(_) => false,
        }
    }

    /// Renews a lease without locks. The owner must call it at intervals shorter than [`STALE`].
    pub fn renew(&self) {
        if self.lock.is_none() {
            let touched = File::options().write(true).open(&self.path);
            // A failure has no effect until the lease is stale.
            let _ = touched.and_then(|file| file.set_modified(SystemTime::now()));
        }
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        if self.lock.is_none() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Returns the owner of a lease without locks if it was renewed recently.
fn fresh_owner(path: &Path) -> Option<String> {
    Some(owner(path)).filter(|owner| !owner.is_empty() && age(path).is_ok_and(|age| age < STALE))
}

fn owner(path: &Path) -> String {
    let mut text = String::new();
    // The owner may not have been written to a new file yet.
    let _ = File::open(path).and_then(|file| file.take(2048).read_to_string(&mut text));
    text.trim().into()
}

fn write_owner(mut file: &File, url: &str) -> io::Result<()> {
    file.set_len(0)?;
    file.rewind()?;
    file.write_all(url.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_server_plays_an_episode_and_others_know_where() {
        let folder = tempfile::tempdir().unwrap();
        let journal = folder.path().join("handover-seed0.jsonl");
        let Leasing::Taken(lease) = Lease::take(&journal, "http://a:1").unwrap() else {
            panic!("it is free")
        };
        let Leasing::Held { url } = Lease::take(&journal, "http://b:1").unwrap() else {
            panic!("it is held")
        };
        assert_eq!(url, "http://a:1");
        assert!(Lease::is_elsewhere(&journal, "http://b:1") && !Lease::is_elsewhere(&journal, "http://a:1"));
        drop(lease);
        assert!(!Lease::is_elsewhere(&journal, "http://b:1"));
        assert!(matches!(Lease::take(&journal, "http://b:1").unwrap(), Leasing::Taken(_)));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing is left of it");
    }
}
