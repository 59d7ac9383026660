//! Files that somebody names, read without trusting what they are: a device has no end, and a pipe may never have a beginning.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Largest file of text, as MJCF, TOML or OBJ.
pub const MAX_TEXT_BYTES: u64 = 256 << 20;

/// Opens a regular file of at most `max_bytes`.
pub fn open_regular(path: &Path, max_bytes: u64) -> io::Result<File> {
    // To open a pipe is to wait for somebody who writes.
    check(&std::fs::metadata(path)?, max_bytes)?;
    let file = File::open(path)?;
    check(&file.metadata()?, max_bytes)?;
    Ok(file)
}

/// Reads a regular file of at most `max_bytes`.
pub fn read_regular(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // What grows while it is read is cut.
    open_regular(path, max_bytes)?.take(max_bytes).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads a regular file of text.
pub fn read_regular_text(path: &Path) -> io::Result<String> {
    let bytes = read_regular(path, MAX_TEXT_BYTES)?;
    String::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}

fn check(metadata: &std::fs::Metadata, max_bytes: u64) -> io::Result<()> {
    let refuse = |what: String| Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    if metadata.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !metadata.is_file() {
        return refuse("it is no regular file".into());
    }
    match metadata.len() {
        bytes if bytes > max_bytes => {
            refuse(format!("it has {bytes} bytes, and {max_bytes} are the most that are read"))
        }
        _ => Ok(()),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_read_that_has_no_end() {
        let folder = std::env::temp_dir().join(format!("tandem-files-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let [file, pipe] = ["file", "pipe"].map(|name| folder.join(name));
        std::fs::write(&file, "12345").unwrap();
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert_eq!(read_regular(&file, 5).unwrap(), b"12345");
        let refused = |path: &Path| read_regular(path, 4).unwrap_err().to_string();
        assert!(refused(&file).contains("5 bytes, and 4 are the most"), "{}", refused(&file));
        for path in [Path::new("/dev/zero"), &pipe] {
            assert!(refused(path).contains("no regular file"), "{}", refused(path));
        }
        assert!(read_regular(&folder, 4).is_err());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
