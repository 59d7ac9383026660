//! Bearer tokens: words that only who may come in knows. They are compared in a time that says nothing of them, and never printed.

use std::{
    env,
    fmt::{self, Write},
    fs, io,
    path::{Path, PathBuf},
};

use subtle::{Choice, ConstantTimeEq};

/// The most bytes of a token.
const LONGEST: usize = 256;

/// A shorter one could be guessed.
const SHORTEST: usize = 16;

/// What a made token is made of: 160 bits.
const RANDOM_BYTES: usize = 20;

/// A token, filled up with zeros, which no token contains.
#[derive(Clone)]
pub struct Token([u8; LONGEST]);

/// Why something is no token.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// The file cannot be read.
    #[error("cannot read the token in {}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It does not have the form of a token.
    #[error(
        "the token of {place} has to be {SHORTEST} to {LONGEST} letters, digits and signs without spaces; `openssl rand -hex 32` makes one"
    )]
    Form {
        /// Where it came from.
        place: String,
    },
    /// The system has no random numbers.
    #[error("no random numbers for a token: {0}")]
    Random(getrandom::Error),
}

/// The environment's variable with the server's token.
const TOKEN: &str = "TANDEM_TOKEN";

impl Token {
    /// The token in the environment's variable `TANDEM_TOKEN`, if it is set.
    pub fn of_environment() -> Result<Option<Token>, TokenError> {
        let text = env::var_os(TOKEN).filter(|text| !text.is_empty());
        // What is no text has no form of a token.
        text.map(|text| Token::of(&text.to_string_lossy(), TOKEN)).transpose()
    }

    /// The token in a file, without the white space around it.
    pub fn read(path: &Path) -> Result<Token, TokenError> {
        let text =
            fs::read_to_string(path).map_err(|source| TokenError::Read { path: path.into(), source })?;
        if readable_by_others(path) {
            tracing::warn!(file = %path.display(), "others on this machine can read the token; chmod 600 keeps it");
        }
        Token::of(text.trim(), &path.display().to_string())
    }

    /// The token `text`, which was given in `place`.
    pub fn of(text: &str, place: &str) -> Result<Token, TokenError> {
        if text.len() < SHORTEST || !has_form(text) {
            return Err(TokenError::Form { place: place.into() });
        }
        Ok(filled(text))
    }

    /// A new token that nobody can guess, and its text for whom it is made.
    pub fn random() -> Result<(Token, String), TokenError> {
        let mut bytes = [0; RANDOM_BYTES];
        getrandom::fill(&mut bytes).map_err(TokenError::Random)?;
        let text = bytes.iter().fold(String::new(), |mut text, byte| {
            // Writing to a text cannot fail.
            let _ = write!(text, "{byte:02x}");
            text
        });
        Ok((filled(&text), text))
    }

    /// Whether `text` is this token, found out in the same time whatever it is.
    pub fn is(&self, text: &str) -> bool {
        let fits = Choice::from(u8::from(has_form(text)));
        let given = if has_form(text) { filled(text) } else { Token([0; LONGEST]) };
        (fits & self.0.ct_eq(&given.0)).into()
    }
}

#[cfg(unix)]
fn readable_by_others(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    fs::metadata(path).is_ok_and(|file| file.permissions().mode() & 0o077 != 0)
}

#[cfg(not(unix))]
fn readable_by_others(_: &Path) -> bool {
    false
}

fn has_form(text: &str) -> bool {
    text.len() <= LONGEST && text.bytes().all(|byte| byte.is_ascii_graphic())
}

fn filled(text: &str) -> Token {
    let mut bytes = [0; LONGEST];
    bytes[..text.len()].copy_from_slice(text.as_bytes());
    Token(bytes)
}

impl fmt::Debug for Token {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.write_str("Token(..)")
    }
}

impl PartialEq for Token {
    fn eq(&self, other: &Token) -> bool {
        self.0.ct_eq(&other.0).into()
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    const GOOD: &str = "0123456789abcdef";

    #[test]
    fn a_token_is_its_own_text_and_no_other() {
        let token = Token::of(GOOD, "a test").unwrap();
        assert!(token.is(GOOD));
        let longer = format!("{GOOD}0");
        for other in
            ["", "0123456789abcdeg", "0123456789abcde", &longer, "0123456789abcdef\0", &"x".repeat(300)]
        {
            assert!(!token.is(other), "{other:?}");
        }
        assert_eq!(format!("{token:?}"), "Token(..)");
    }

    #[test]
    fn what_could_be_guessed_is_no_token() {
        let long = "x".repeat(257);
        for text in ["", "0123456789abcde", "0123456789 abcdef", "0123456789abcdeü", &long] {
            let refused = Token::of(text, "TANDEM_TOKEN").unwrap_err().to_string();
            assert!(refused.contains("TANDEM_TOKEN") && refused.contains("openssl"), "{refused}");
            assert!(text.is_empty() || !refused.contains(text), "{refused}");
        }
    }

    #[test]
    fn made_tokens_differ() {
        let [(one, text), (other, _)] = [(); 2].map(|()| Token::random().unwrap());
        assert!(one.is(&text) && !other.is(&text) && one != other);
        assert_eq!(text.len(), 2 * RANDOM_BYTES);
    }

    #[test]
    fn files_may_end_their_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        fs::write(&path, format!("{GOOD}\n")).unwrap();
        assert!(Token::read(&path).unwrap().is(GOOD));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        assert!(!readable_by_others(&path));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        assert!(readable_by_others(&path));
        fs::write(&path, "short\n").unwrap();
        assert!(Token::read(&path).unwrap_err().to_string().contains("16 to 256"));
        assert!(Token::read(folder.path()).unwrap_err().to_string().contains("cannot read"));
    }
}
