//! Address of a policy's server and the key that it requires.

use std::{
    env, fmt,
    net::IpAddr,
    path::{Path, PathBuf},
};

use tungstenite::http::HeaderValue;

/// Environment variable with the key.
const KEY_VARIABLE: &str = "TANDEM_POLICY_KEY";

/// Maximum size of a key file in bytes.
const MAX_KEY_BYTES: u64 = 8 << 10;

/// Address of a policy's server, with the key that it requires.
#[derive(Clone, Debug)]
pub struct PolicyAddress {
    /// URL with its scheme.
    pub url: String,
    /// Key that requests need; `None` if the server requires none.
    pub key: Option<PolicyKey>,
}

/// A key that a policy's server requires. It is never printed.
#[derive(Clone)]
pub struct PolicyKey(HeaderValue);

/// Reason why a key cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PolicyKeyError {
    /// The file cannot be read.
    #[error("cannot read the policy's key in {}: {source}", .path.display())]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The text is not a valid key.
    #[error(
        "the policy's key of {place} has to be one line of letters, digits and signs; unset it for a server \
         that wants none"
    )]
    Form {
        /// Source of the key.
        place: String,
    },
    /// The key would be sent unencrypted.
    #[error(
        "a key would go unencrypted to {url}; give {protocol}:{encrypted}HOST, or unset {KEY_VARIABLE} for a \
         server that wants none"
    )]
    Unencrypted {
        /// URL of the server.
        url: String,
        /// Name of the protocol.
        protocol: &'static str,
        /// URL scheme of encrypted servers.
        encrypted: &'static str,
    },
}

impl PolicyKey {
    /// Reads the key from `file`, or else from the environment variable `TANDEM_POLICY_KEY` if it is set.
    pub fn find(file: Option<&Path>) -> Result<Option<PolicyKey>, PolicyKeyError> {
        if let Some(path) = file {
            let unreadable = |source| PolicyKeyError::Unreadable { path: path.into(), source };
            let text = tandem_episodes::read_text(path, MAX_KEY_BYTES).map_err(unreadable)?;
            return PolicyKey::parse(&text, &path.display().to_string()).map(Some);
        }
        let Some(text) = env::var_os(KEY_VARIABLE) else { return Ok(None) };
        PolicyKey::parse(&text.to_string_lossy(), KEY_VARIABLE).map(Some)
    }

    fn parse(text: &str, place: &str) -> Result<PolicyKey, PolicyKeyError> {
        let form = || PolicyKeyError::Form { place: place.into() };
        let text = Some(text.trim()).filter(|text| !text.is_empty() && text.is_ascii()).ok_or_else(form)?;
        let mut value = HeaderValue::from_str(text).map_err(|_| form())?;
        value.set_sensitive(true);
        Ok(PolicyKey(value))
    }

    /// Returns the value of the header `Authorization`: the key after `scheme`, or the key alone if it
    /// names a scheme itself.
    pub fn authorization(&self, scheme: &str) -> HeaderValue {
        let text = self.0.to_str().unwrap_or_default();
        let whole = match text.contains(' ') {
            true => text.to_owned(),
            false => format!("{scheme} {text}"),
        };
        // The key is a valid header value, so the combined text is valid, too.
        let mut value = HeaderValue::from_str(&whole).unwrap_or_else(|_| self.0.clone());
        value.set_sensitive(true);
        value
    }
}

impl fmt::Debug for PolicyKey {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.write_str("PolicyKey(..)")
    }
}

impl PolicyAddress {
    /// Returns the host and port, without the scheme.
    pub fn authority(&self) -> &str {
        let rest = self.url.split_once("://").map_or(self.url.as_str(), |(_, rest)| rest);
        rest.split(['/', '?', '#']).next().unwrap_or_default()
    }

    /// Returns the host without port and without the brackets of IPv6 addresses.
    pub fn host(&self) -> &str {
        let authority = self.authority();
        match authority.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            Some((host, _)) => host,
            None => authority.rsplit_once(':').map_or(authority, |(host, _)| host),
        }
    }

    /// Returns the port, if the address contains a port.
    pub fn port(&self) -> Option<u16> {
        let authority = self.authority();
        let behind = authority.rsplit_once(']').map_or(authority, |(_, behind)| behind);
        behind.rsplit_once(':')?.1.parse().ok()
    }

    /// Returns true if the server is on this machine.
    pub fn is_loopback(&self) -> bool {
        let host = self.host();
        host.eq_ignore_ascii_case("localhost")
            || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
    }

    /// Returns true if connections are encrypted.
    pub fn is_encrypted(&self) -> bool {
        matches!(self.url.split_once("://"), Some(("wss" | "https", _)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_have_hosts_and_ports() {
        let check = |url: &str, host: &str, port: Option<u16>, is_loopback: bool| {
            let address = PolicyAddress { url: url.into(), key: None };
            let found = (address.host(), address.port(), address.is_loopback());
            assert_eq!(found, (host, port, is_loopback), "{url}");
        };
        check("ws://127.0.0.1:8000/", "127.0.0.1", Some(8000), true);
        check("https://[::1]:8000/act", "::1", Some(8000), true);
        check("wss://[::1]", "::1", None, true);
        check("http://LOCALHOST:1/act", "LOCALHOST", Some(1), true);
        check("wss://policies.example/v1?x=1:2", "policies.example", None, false);
    }

    #[test]
    fn keys_are_sent_and_never_printed() {
        let sent = |text: &str| {
            let key = PolicyKey::parse(text, "a test").unwrap();
            assert!(!format!("{key:?}").contains("secret"));
            key.authorization("Api-Key").to_str().unwrap().to_owned()
        };
        assert_eq!(sent(" secret\n"), "Api-Key secret");
        assert_eq!(sent("Bearer secret"), "Bearer secret");
        for text in ["", " \n", "a\nb", "ä"] {
            assert!(PolicyKey::parse(text, "a test").is_err(), "{text:?}");
        }
    }
}
