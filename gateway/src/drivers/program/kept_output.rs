//! What a program says, kept in files of a bounded size: a program that never stops talking fills no disk.

use std::{
    fs::File,
    io::{self, Read, Write},
    sync::mpsc,
    thread,
    time::Duration,
};

/// The most bytes that are kept of each of a program's two outputs.
pub const MAX_OUTPUT_BYTES: u64 = 64 << 20;

/// What stands where more was said.
const CUT: &[u8] = b"\n... (cut here: 64 MiB of a program's output are kept)\n";

/// How long the last words may take to be written, once the program has gone. What it has left running may hold its output open.
const LAST_WORDS_WAIT: Duration = Duration::from_secs(1);

/// An output that is being kept.
pub struct KeptOutput(mpsc::Receiver<()>);

impl KeptOutput {
    /// Copies what `output` says to `file`; what is too much is read and thrown away.
    pub fn start(output: impl Read + Send + 'static, file: File) -> io::Result<KeptOutput> {
        let (done, ended) = mpsc::channel();
        let copy = move || {
            // A disk that is full keeps no words, and the program goes on all the same.
            let _ = keep(output, file, MAX_OUTPUT_BYTES);
            drop(done);
        };
        thread::Builder::new().name("output of a program".into()).spawn(copy)?;
        Ok(KeptOutput(ended))
    }

    /// Returns when all of it is written, or after a moment.
    pub fn finish(self) {
        // The other end says nothing, and is dropped.
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
    // Whoever is not read from stands still.
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

    /// Nothing is written, and everything is read.
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
