//! Bearer tokens of permitted callers. Tokens are compared in constant time and their text is never logged.

use std::{
    env,
    ffi::OsStr,
    fmt::{self, Write},
    io,
    path::{Path, PathBuf},
};

use subtle::{Choice, ConstantTimeEq};
use tandem_episodes::read_text;

/// Maximum length of a token in bytes.
const MAX_LENGTH: usize = 256;

/// Maximum size of a token file in bytes.
const MAX_FILE_BYTES: u64 = 64 << 10;

/// Minimum length of a token in bytes; a shorter token could be guessed.
const MIN_LENGTH: usize = 16;

/// Number of random bytes in a generated token: 160 bits.
const RANDOM_BYTES: usize = 20;

/// A token, padded with zeros, which tokens never contain.
#[derive(Clone)]
pub struct Token([u8; MAX_LENGTH]);

/// Reason why a token cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// The file cannot be read.
    #[error("cannot read the token in {}: {source}", .path.display())]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The text is not a well-formed token.
    #[error(
        "the token of {place} has to be {MIN_LENGTH} to {MAX_LENGTH} letters, digits and signs without \
         spaces; `openssl rand -hex 32` makes one"
    )]
    Form {
        /// Source of the text.
        place: String,
    },
    /// The setting is empty. It is refused, because the user would wrongly expect a protected server.
    #[error(
        "{setting} is set and empty; give a token by it (`openssl rand -hex 32` makes one), or unset it for \
         a server without"
    )]
    Empty {
        /// Name of the setting.
        setting: &'static str,
    },
    /// The operating system provides no random numbers.
    #[error("no random numbers for a token: {0}")]
    Random(getrandom::Error),
}

/// Environment variable with the server's token.
const TOKEN_VARIABLE: &str = "TANDEM_TOKEN";

impl Token {
    /// Reads the token from the environment variable `TANDEM_TOKEN`, if it is set.
    pub fn from_environment() -> Result<Option<Token>, TokenError> {
        env::var_os(TOKEN_VARIABLE).map(|text| Token::from_variable(&text)).transpose()
    }

    fn from_variable(text: &OsStr) -> Result<Token, TokenError> {
        if text.is_empty() {
            return Err(TokenError::Empty { setting: TOKEN_VARIABLE });
        }
        // Invalid UTF-8 becomes a replacement character, which no token has, so the text is refused.
        Token::parse(&text.to_string_lossy(), TOKEN_VARIABLE)
    }

    /// Reads the token from a file and removes surrounding white space.
    pub fn read(path: &Path) -> Result<Token, TokenError> {
        let text = read_text(path, MAX_FILE_BYTES)
            .map_err(|source| TokenError::Read { path: path.into(), source })?;
        if readable_by_others(path) {
            tracing::warn!(file = %path.display(), "others on this machine can read the token; chmod 600 keeps it");
        }
        Token::parse(text.trim(), &path.display().to_string())
    }

    /// Parses the token `text`. Errors name `place` as its source.
    pub fn parse(text: &str, place: &str) -> Result<Token, TokenError> {
        if text.len() < MIN_LENGTH || !is_well_formed(text) {
            return Err(TokenError::Form { place: place.into() });
        }
        Ok(padded(text))
    }

    /// Generates a random token, and returns it with its text for the owner.
    pub fn random() -> Result<(Token, String), TokenError> {
        let mut bytes = [0; RANDOM_BYTES];
        getrandom::fill(&mut bytes).map_err(TokenError::Random)?;
        let text = bytes.iter().fold(String::new(), |mut text, byte| {
            // Writing to a string cannot fail.
            let _ = write!(text, "{byte:02x}");
            text
        });
        Ok((padded(&text), text))
    }

    /// Returns true if `text` is this token. The comparison takes the same time for any text.
    pub fn matches(&self, text: &str) -> bool {
        let fits = Choice::from(u8::from(is_well_formed(text)));
        let given = if is_well_formed(text) { padded(text) } else { Token([0; MAX_LENGTH]) };
        (fits & self.0.ct_eq(&given.0)).into()
    }
}

#[cfg(unix)]
fn readable_by_others(path: &Path) -> bool {
    use std::{fs, os::unix::fs::PermissionsExt};
    fs::metadata(path).is_ok_and(|file| file.permissions().mode() & 0o077 != 0)
}

#[cfg(not(unix))]
fn readable_by_others(_: &Path) -> bool {
    false
}

fn is_well_formed(text: &str) -> bool {
    text.len() <= MAX_LENGTH && text.bytes().all(|byte| byte.is_ascii_graphic())
}

fn padded(text: &str) -> Token {
    let mut bytes = [0; MAX_LENGTH];
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
    use std::{fs, os::unix::fs::PermissionsExt};

    use super::*;

    const GOOD: &str = "0123456789abcdef";

    #[test]
    fn a_token_is_its_own_text_and_no_other() {
        let token = Token::parse(GOOD, "a test").unwrap();
        assert!(token.matches(GOOD));
        let longer = format!("{GOOD}0");
        for other in
            ["", "0123456789abcdeg", "0123456789abcde", &longer, "0123456789abcdef\0", &"x".repeat(300)]
        {
            assert!(!token.matches(other), "{other:?}");
        }
        assert_eq!(format!("{token:?}"), "Token(..)");
    }

    #[test]
    fn what_could_be_guessed_is_no_token() {
        let long = "x".repeat(257);
        for text in ["", "0123456789abcde", "0123456789 abcdef", "0123456789abcdeü", &long] {
            let refused = Token::parse(text, "TANDEM_TOKEN").unwrap_err().to_string();
            assert!(refused.contains("TANDEM_TOKEN") && refused.contains("openssl"), "{refused}");
            assert!(text.is_empty() || !refused.contains(text), "{refused}");
        }
    }

    #[test]
    fn a_variable_that_is_set_has_a_token() {
        assert!(Token::from_variable(OsStr::new(GOOD)).unwrap().matches(GOOD));
        let refused = Token::from_variable(OsStr::new("")).unwrap_err().to_string();
        assert!(
            refused.contains("TANDEM_TOKEN is set and empty") && refused.contains("unset it"),
            "{refused}"
        );
    }

    #[test]
    fn made_tokens_differ() {
        let [(one, text), (other, _)] = [(); 2].map(|()| Token::random().unwrap());
        assert!(one.matches(&text) && !other.matches(&text) && one != other);
        assert_eq!(text.len(), 2 * RANDOM_BYTES);
    }

    #[test]
    fn files_may_end_their_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        fs::write(&path, format!("{GOOD}\n")).unwrap();
        assert!(Token::read(&path).unwrap().matches(GOOD));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).unwrap();
        assert!(!readable_by_others(&path));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        assert!(readable_by_others(&path));
        fs::write(&path, "short\n").unwrap();
        assert!(Token::read(&path).unwrap_err().to_string().contains("16 to 256"));
        fs::write(&path, "").unwrap();
        assert!(Token::read(&path).unwrap_err().to_string().contains("16 to 256"));
        assert!(Token::read(folder.path()).unwrap_err().to_string().contains("cannot read"));
    }
}
