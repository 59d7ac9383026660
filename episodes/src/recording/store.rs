//! Where the bytes of a recording go: to a file that others can read under way, or nowhere before the end.

use std::{
    fs::File,
    io::{self, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use crate::output::{OutputError, partial_path, put_in_place, write_whole};

/// When a recording can be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Visibility {
    /// Under way, as `episode.mcap.partial`.
    #[default]
    Live,
    /// After the end. Nobody can look behind the curtain meanwhile, and a process that is killed leaves nothing.
    After,
}

/// What has been written since the last flush, and where it goes then. A flush is one write to the system, so that what lies
/// on the disk ends where a flush ended.
pub struct Store {
    pending: Vec<u8>,
    flushed_bytes: u64,
    target: Target,
}

enum Target {
    File {
        file: File,
        partial: PathBuf,
    },
    Memory,
    /// A flush has failed. Nothing more is written: what lies on the disk ends in the middle of a record.
    Failed,
}

impl Store {
    /// A store for what will be `path` when it is complete. A file of that partial name is overwritten.
    pub fn create(path: &Path, visibility: Visibility) -> io::Result<Store> {
        let target = match visibility {
            Visibility::Live => {
                let partial = partial_path(path);
                Target::File { file: File::create(&partial)?, partial }
            }
            Visibility::After => Target::Memory,
        };
        Ok(Store { pending: Vec::new(), flushed_bytes: 0, target })
    }

    /// Puts everything on the disk under the name `path`.
    pub fn keep(mut self, path: &Path) -> Result<(), OutputError> {
        let failed = |source| OutputError::Io { path: path.into(), source };
        self.flush().map_err(failed)?;
        match &self.target {
            Target::File { file, partial } => put_in_place(file, partial, path).map_err(failed),
            Target::Memory => write_whole(path, &self.pending),
            Target::Failed => Err(failed(after_a_failure())),
        }
    }
}

fn after_a_failure() -> io::Error {
    io::Error::other("an earlier part could not be written")
}

impl Write for Store {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.target {
            Target::Failed => Err(after_a_failure()),
            Target::File { .. } | Target::Memory => {
                self.pending.extend_from_slice(bytes);
                Ok(bytes.len())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        let Target::File { file, .. } = &mut self.target else { return Ok(()) };
        let written = file.write_all(&self.pending);
        self.flushed_bytes += self.pending.len() as u64;
        self.pending.clear();
        if written.is_err() {
            self.target = Target::Failed;
        }
        written
    }
}

/// MCAP's writer asks where it is; it is told not to go back.
impl Seek for Store {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        match position {
            SeekFrom::Current(0) => Ok(self.flushed_bytes + self.pending.len() as u64),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}

/// A recording that is dropped before its end stays readable to where it stopped.
impl Drop for Store {
    fn drop(&mut self) {
        let _ = self.flush();
    }
}
