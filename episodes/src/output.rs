//! Writing of an episode's files, and its errors.

use std::{
    fs::{self, File},
    io::{self, Write},
    path::{Path, PathBuf},
    process,
    sync::atomic::{AtomicU32, Ordering},
};

/// Error while a file of a run folder is written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    #[error(
        "cannot write {}: {source}; give a folder on a disk with space that may be written to",
        path.display()
    )]
    Io { path: PathBuf, source: io::Error },
    #[error("the recording {} cannot be written: {source}", path.display())]
    Mcap { path: PathBuf, source: mcap::McapError },
    #[error("a record of the episode cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error("a message of the recording cannot be encoded: {0}")]
    Encode(#[source] Box<dyn std::error::Error + Send + Sync>),
}

impl OutputError {
    /// Wraps an error of the recording at `path`. An I/O error is reported as such.
    pub fn of_recording(path: &Path, source: mcap::McapError) -> OutputError {
        match source {
            mcap::McapError::Io(source) => OutputError::Io { path: path.into(), source },
            source => OutputError::Mcap { path: path.into(), source },
        }
    }
}

/// Returns a text that is safe to print to a terminal. Control characters are replaced, so text from
/// other sources cannot move the cursor or change colours and title.
pub fn printable(text: &str) -> String {
    let shown = |character: char| match character {
        '\n' | '\t' => character,
        character if character.is_control() => char::REPLACEMENT_CHARACTER,
        character => character,
    };
    text.chars().map(shown).collect()
}

/// Quotes a word for a shell.
pub fn shell_word(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"_-./:=@%+,".contains(&byte);
    match !text.is_empty() && text.bytes().all(plain) {
        true => text.into(),
        false => format!("'{}'", text.replace('\'', r"'\''")),
    }
}

/// Writes a file atomically: under another name first, then renamed once it is complete and on the disk. A
/// reader sees the whole file or no file, even after a power cut. A failed write removes its temporary file.
///
/// # Errors
///
/// [`OutputError::Io`] if the file cannot be written.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_whole_as(&own_partial_path(path), path, bytes)
}

/// Writes a file like [`write_whole`], with `under_way` as its temporary name. Use it for files whose usual
/// temporary name belongs to another file.
pub fn write_whole_as(under_way: &Path, path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let written = File::create(under_way).and_then(|mut file| {
        file.write_all(bytes)?;
        put_in_place(&file, under_way, path)
    });
    written.map_err(|source| {
        let _ = fs::remove_file(under_way);
        OutputError::Io { path: path.into(), source }
    })
}

/// Returns a temporary name unique to this process and call, since another process may write the same file.
fn own_partial_path(path: &Path) -> PathBuf {
    static WRITTEN: AtomicU32 = AtomicU32::new(0);
    let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
    let mut partial = path.to_path_buf().into_os_string();
    partial.push(format!(".{}-{number}.partial", process::id()));
    partial.into()
}

/// Returns the name of a file until it is complete.
pub fn partial_path(path: &Path) -> PathBuf {
    let mut partial = path.to_path_buf().into_os_string();
    partial.push(".partial");
    partial.into()
}

/// Renames a complete file into place once its bytes are on the disk.
pub fn put_in_place(file: &File, partial: &Path, path: &Path) -> io::Result<()> {
    file.sync_all()?;
    fs::rename(partial, path)?;
    // The name is part of the folder, which must be synced too; not every file system supports this.
    if let Some(Ok(folder)) = path.parent().map(File::open) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Creates a folder and its missing parents, accessible to their owner only: recordings contain data that
/// policies must not see.
pub fn create_private_folder(folder: &Path) -> io::Result<()> {
    private_folder(true).create(folder)
}

/// Creates a folder like [`create_private_folder`], but fails if it exists or its parent does not.
pub fn create_new_private_folder(folder: &Path) -> io::Result<()> {
    private_folder(false).create(folder)
}

fn private_folder(with_parents: bool) -> fs::DirBuilder {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(with_parents);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder
}

/// Encoding of images and videos as WebP.
pub mod webp {
    use webp_animation::{ColorMode, Encoder, EncoderOptions, EncodingConfig, Error};

    /// Quality from 0 to 100; at this value the robots' edges stay clean.
    const QUALITY: f32 = 80.0;

    /// Encodes one RGB image, three bytes a pixel, as a file.
    pub fn picture(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, Error> {
        let mut encoder = encoder((width, height))?;
        encoder.add_frame(rgb, 0)?;
        Ok(encoder.finalize(1)?.to_vec())
    }

    /// Returns an encoder of RGB images.
    pub fn encoder(size_px: (u32, u32)) -> Result<Encoder, Error> {
        let options = EncoderOptions {
            color_mode: ColorMode::Rgb,
            encoding_config: Some(EncodingConfig::new_lossy(QUALITY)),
            ..EncoderOptions::default()
        };
        Encoder::new_with_options(size_px, options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_back_what_was_meant() {
        assert_eq!(shell_word("runs/pi05-2"), "runs/pi05-2");
        assert_eq!(shell_word("my runs"), "'my runs'");
        assert_eq!(shell_word("it's $HOME"), r"'it'\''s $HOME'");
        assert_eq!(shell_word(""), "''");
    }

    #[test]
    fn a_terminal_obeys_nobody_elses_text() {
        assert_eq!(
            printable("a\u{1b}[2Jb\r\u{9b}31mc\n\td\u{7}é"),
            "a\u{fffd}[2Jb\u{fffd}\u{fffd}31mc\n\td\u{fffd}é"
        );
    }

    #[test]
    fn files_of_one_name_are_written_under_names_of_their_own() {
        let path = Path::new("runs/results.json");
        let [one, other] = [own_partial_path(path), own_partial_path(path)];
        assert!(one != other && one.parent() == path.parent(), "{one:?} {other:?}");
        assert_eq!(other.extension(), Some("partial".as_ref()));
    }

    #[test]
    fn what_cannot_be_put_in_place_leaves_nothing_behind() {
        let place = tempfile::tempdir().unwrap();
        let taken = place.path().join("taken");
        fs::create_dir(&taken).unwrap();
        let text = write_whole(&taken, b"bytes").unwrap_err().to_string();
        assert!(text.contains("taken") && text.contains("give a folder"), "{text}");
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
    }
}
