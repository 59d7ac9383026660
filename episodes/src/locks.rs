//! File locks, so that two processes never write the same file. A lock ends with the process that holds it,
//! however that process ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

/// Error number of file systems without locks, for example NFS without its lock daemon.
const ENOLCK: i32 = if cfg!(target_os = "linux") { 37 } else { 77 };

/// Interval between two attempts of a wait.
const RETRY_INTERVAL: Duration = Duration::from_millis(50);

/// Kind of a lock: exclusive or shared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LockKind {
    /// A lock with at most one holder.
    Exclusive,
    /// Any number of holders of shared locks.
    Shared,
}

/// Outcome of an attempt to lock a file.
#[derive(Debug)]
pub enum Locking {
    Locked(FileLock),
    /// Another process, or another thread of this one, holds the lock.
    Held,
    /// The file system has no locks, so there is never a holder.
    Unsupported,
}

/// A lock on a file. Dropping it releases the lock.
#[derive(Debug)]
pub struct FileLock {
    file: File,
    /// Path of a lock file to remove on release; `None` if the file has another purpose.
    remove: Option<PathBuf>,
}

impl FileLock {
    /// Attempts to lock the file at `path`. Creates the file if it is missing; an existing file keeps its
    /// content.
    ///
    /// # Errors
    ///
    /// If the file cannot be opened, or locking fails for another reason.
    pub fn attempt(path: &Path, kind: LockKind) -> io::Result<Locking> {
        loop {
            let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
            let locked = match kind {
                LockKind::Exclusive => file.try_lock(),
                LockKind::Shared => file.try_lock_shared(),
            };
            match locked {
                // A former holder may have removed or renamed the file since it was opened. The path then
                // refers to another file, or to none.
                Ok(()) if is_at(&file, path)? => {
                    return Ok(Locking::Locked(FileLock { file, remove: None }));
                }
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Ok(Locking::Held),
                Err(TryLockError::Error(error)) if is_unsupported(&error) => return Ok(Locking::Unsupported),
                Err(TryLockError::Error(error)) => return Err(error),
            }
        }
    }

    /// Waits for an exclusive lock on the file at `path` while `waits` returns `true`. Returns `None` if the
    /// file system has no locks or the wait has ended.
    ///
    /// # Errors
    ///
    /// If the file cannot be opened, or locking fails for another reason.
    pub fn wait(path: &Path, waits: impl Fn() -> bool) -> io::Result<Option<FileLock>> {
        loop {
            match FileLock::attempt(path, LockKind::Exclusive)? {
                Locking::Locked(lock) => return Ok(Some(lock.removing(path))),
                Locking::Unsupported => return Ok(None),
                Locking::Held if !waits() => return Ok(None),
                Locking::Held => thread::sleep(RETRY_INTERVAL),
            }
        }
    }

    /// Removes the file on release. The lock must be exclusive.
    pub fn removing(mut self, path: &Path) -> FileLock {
        self.remove = Some(path.into());
        self
    }

    /// Returns the locked file.
    pub fn file(&self) -> &File {
        &self.file
    }
}

impl Drop for FileLock {
    fn drop(&mut self) {
        if let Some(path) = &self.remove {
            // If this fails, an empty file remains, and the next lock takes it.
            let _ = fs::remove_file(path);
        }
    }
}

/// Returns `true` for the errors of a file system without locks, and false for those of a lock that is held.
fn is_unsupported(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::Unsupported || error.raw_os_error() == Some(ENOLCK)
}

/// Returns `true` if `file` is the one at `path` now.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let opened = file.metadata()?;
    match fs::symlink_metadata(path) {
        Ok(named) => Ok((named.dev(), named.ino()) == (opened.dev(), opened.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Returns `true`: other systems do not remove or rename a file that is open.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> io::Result<bool> {
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_held_by_one_or_shared_by_several() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let attempt = |kind| FileLock::attempt(&path, kind).unwrap();
        let is_held = |kind| matches!(attempt(kind), Locking::Held);
        let Locking::Locked(lock) = attempt(LockKind::Exclusive) else { panic!("nobody holds it") };
        assert!(is_held(LockKind::Exclusive) && is_held(LockKind::Shared));
        drop(lock.removing(&path));
        assert!(!path.exists());
        let Locking::Locked(_one) = attempt(LockKind::Shared) else { panic!("nobody holds it") };
        assert!(is_held(LockKind::Exclusive) && !is_held(LockKind::Shared));
        assert!(FileLock::wait(&path, || false).unwrap().is_none());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_system_without_locks_is_told_from_a_lock_that_is_held() {
        let is_without = |number: i32| is_unsupported(&io::Error::from_raw_os_error(number));
        let [no_call, not_for_this_file, interrupted, broken] = [38, 95, 4, 5];
        assert!([no_call, ENOLCK, not_for_this_file].into_iter().all(is_without));
        assert!(![interrupted, broken].into_iter().any(is_without));
        assert!(!is_unsupported(&io::ErrorKind::WouldBlock.into()));
    }
}
