//! Output of a program, kept in files of a bounded size so that a program cannot fill the disk.

use std::{
    fs::File,
    io::{self, Read, Write},
    sync::mpsc,
    thread,
    time::Duration,
};

/// Maximum number of bytes that are kept of each of a program's two output streams.
pub const MAX_OUTPUT_BYTES: u64 = 64 << 20;

/// Marker at the end of an output that was cut.
const CUT: &[u8] = b"\n... (cut here: 64 MiB of a program's output are kept)\n";

/// Time allowed for writing the last output after the program has ended. Its child processes may still
/// hold the output open.
const LAST_WORDS_WAIT: Duration = Duration::from_secs(1);

/// An output that is being kept.
pub struct KeptOutput(mpsc::Receiver<()>);

impl KeptOutput {
    /// Copies `output` to `file`. Output beyond the limit is read and discarded.
    pub fn start(output: impl Read + Send + 'static, file: File) -> io::Result<KeptOutput> {
        let (done, ended) = mpsc::channel();
        let copy = move || {
            // A full disk loses the output, but the program continues.
            let _ = keep(output, file, MAX_OUTPUT_BYTES);
            drop(done);
        };
        thread::Builder::new().name("output of a program".into()).spawn(copy)?;
        Ok(KeptOutput(ended))
    }

    /// Waits until all output is written, for at most `LAST_WORDS_WAIT`.
    pub fn finish(self) {
        // The sender sends no data. It is dropped when all output is written.
        let _ = self.0.recv_timeout(LAST_WORDS_WAIT);
    }
}

fn keep(mut output: impl Read, mut file: impl Write, max_bytes: u64) -> io::Result<()> {
    let written = io::copy(&mut (&mut output).take(max_bytes), &mut file);
    let mut one_more = [0; 1];
    let kept = match &written {
        Ok(_) if output.read(&mut one_more)? == 0 => Ok(()),
        Ok(_) => file.write_all(CUT),
        Err(_) => Ok(()),
    };
    // A program whose output is not read would block.
    io::copy(&mut output, &mut io::sink())?;
    written.and(kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(said: &str, max_bytes: u64) -> String {
        let mut file = Vec::new();
        keep(said.as_bytes(), &mut file, max_bytes).unwrap();
        String::from_utf8(file).unwrap()
    }

    #[test]
    fn what_is_too_much_is_cut() {
        assert_eq!(kept("words", 5), "words");
        assert_eq!(kept("", 5), "");
        assert!(kept("more words", 4).starts_with("more\n... (cut here"));
    }

    /// All output is read although none of it can be written.
    #[test]
    fn a_full_disk_lets_the_program_go_on() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::StorageFull.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut said = io::Cursor::new(vec![b'x'; 1 << 20]);
        assert!(keep(&mut said, Full, 4).is_err());
        assert_eq!(said.position(), 1 << 20);
    }
}
