//! Reading of files that users name. Only regular files of a bounded size are read, because a device or a
//! pipe has no end.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::{Path, PathBuf},
};

/// Maximum size in bytes of a file with settings, a task, a scene or a map.
pub const MAX_TEXT_BYTES: u64 = 16 << 20;

/// Mark that some editors put in front of a UTF-8 text.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// Reads a text of at most `max_bytes`, without a byte order mark.
///
/// # Errors
///
/// Returns an error if the file cannot be read, is larger, or is not UTF-8.
pub fn read_text(path: &Path, max_bytes: u64) -> io::Result<String> {
    let text = String::from_utf8(read_bytes(path, max_bytes)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let reason = format!("it is no text in UTF-8 (byte {at}); save it as UTF-8");
        io::Error::new(io::ErrorKind::InvalidData, reason)
    })?;
    Ok(match text.strip_prefix(BYTE_ORDER_MARK) {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}

/// Reads a regular file of at most `max_bytes`.
///
/// # Errors
///
/// Returns an error if the file cannot be read, is not a regular file, or is larger.
pub fn read_bytes(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_regular(path)?.take(max_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes {
        return Err(io::Error::other(format!(
            "it has more than {max_bytes} bytes, the most that is read of such a file"
        )));
    }
    Ok(bytes)
}

/// Opens a regular file.
///
/// # Errors
///
/// Returns an error if the file cannot be opened or is not a regular file.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // Opening a pipe would wait for a writer.
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is no regular file; give one, and no folder, device or pipe"));
    }
    File::open(path)
}

/// Returns the path of a file that another file names, with Windows separators replaced if there is no
/// file of the exact name.
pub fn with_own_separators(path: PathBuf) -> PathBuf {
    let Some(text) = path.to_str().filter(|text| text.contains('\\')) else { return path };
    let other = PathBuf::from(text.replace('\\', "/"));
    if !path.exists() && other.exists() { other } else { path }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(path: &Path) -> String {
        read_text(path, 8).unwrap_err().to_string()
    }

    #[test]
    fn a_file_without_an_end_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "123456789").unwrap();
        assert!(refused(&path).contains("more than 8 bytes"));
        assert!(refused(folder.path()).contains("no regular file"));
        #[cfg(unix)]
        assert!(refused(Path::new("/dev/zero")).contains("no regular file"));
        fs::write(&path, b"\xff\xfeh\0").unwrap();
        assert!(refused(&path).contains("save it as UTF-8"));
    }

    #[test]
    fn separators_of_windows_are_understood() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "text").unwrap();
        let named = PathBuf::from(format!("{}\\file", folder.path().display()));
        assert_eq!(fs::read_to_string(with_own_separators(named)).unwrap(), "text");
        let missing = PathBuf::from("no\\file");
        assert_eq!(with_own_separators(missing.clone()), missing);
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_the_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "\u{feff}text").unwrap();
        assert_eq!(read_text(&path, 8).unwrap(), "text");
    }
}
