//! An evaluator's secret key that determines the meaning of seeds. Without the key, no one can simulate an
//! episode in advance.

use std::{error::Error, fs, path::Path};

use ring::hmac::{self, HMAC_SHA256};
use tandem_evaluation::evaluation::SeedKey;

/// Minimum length in bytes; a shorter key could be guessed.
const MIN_KEY_BYTES: usize = 16;

/// Reads the key in a file, without surrounding white space, and draws the meaning of each of `seeds`:
///   drawn = first 4 bytes of HMAC-SHA256(key, "seed " + seed), little endian.
/// The fingerprint, by which results name the key, is the HMAC of another text and reveals nothing about
/// the key.
pub fn read_seed_key(path: &Path, seeds: &[u32]) -> Result<SeedKey, Box<dyn Error>> {
    let shown = path.display();
    let bytes = fs::read(path).map_err(|error| format!("cannot read the seed key in {shown}: {error}"))?;
    let secret = bytes.trim_ascii();
    if secret.len() < MIN_KEY_BYTES {
        let why = format!(
            "the seed key in {shown} has {} bytes; give {MIN_KEY_BYTES} or more: `openssl rand -hex 32` makes one",
            secret.len()
        );
        return Err(why.into());
    }
    let key = hmac::Key::new(HMAC_SHA256, secret);
    let code = |text: String| hmac::sign(&key, text.as_bytes());
    let drawn = |seed: &u32| {
        let first = code(format!("seed {seed}")).as_ref().first_chunk().copied().unwrap_or_default();
        (*seed, u32::from_le_bytes(first))
    };
    let fingerprint =
        code("fingerprint".into()).as_ref()[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(SeedKey { fingerprint, drawn: seeds.iter().map(drawn).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_draws_the_same_again_and_another_key_something_else() {
        let folder = tempfile::tempdir().unwrap();
        let read = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::write(&path, text).unwrap();
            read_seed_key(&path, &[1, 2]).map_err(|error| error.to_string())
        };
        let one = read("one", "0123456789abcdef\n").unwrap();
        assert_eq!(one, read("again", "0123456789abcdef").unwrap());
        assert_eq!(one.fingerprint.len(), 16);
        assert_ne!((one.drawn[&1], one.drawn[&1]), (1, one.drawn[&2]));
        let other = read("other", "0123456789abcdeg").unwrap();
        assert!(other.fingerprint != one.fingerprint && other.drawn[&1] != one.drawn[&1]);
        let short = read("short", "0123").unwrap_err();
        assert!(short.contains("has 4 bytes; give 16 or more"), "{short}");
    }
}
