//! Reasons why a policy server yields no action. Each message states the received and the expected value.

use std::time::Duration;

use tandem_episodes::printable;

/// A failure of a policy server.
#[derive(Debug, thiserror::Error)]
pub enum RemoteError {
    /// No server is listening at the address yet.
    #[error("no policy answers at {url}: {reason}")]
    Unreachable { url: String, reason: String },
    /// The connection to the server has broken.
    #[error("the policy at {url} is gone: {reason}")]
    Gone { url: String, reason: String },
    /// The server exceeds its time limit.
    #[error("the policy at {url} gave no answer within {} s", .within.as_secs_f64())]
    Slow { url: String, within: Duration },
    /// The server reports that it failed.
    #[error("the policy at {url} failed: {text}")]
    Failed { url: String, text: String },
    /// The server's message violates its protocol.
    #[error("the policy at {url} sent what cannot be read: {reason}")]
    Unreadable { url: String, reason: String },
    /// The server's answer does not conform to the map.
    #[error("the policy's answer does not fit its map: {0}")]
    Misfit(String),
}

impl RemoteError {
    /// Returns advice for failures that would recur in the next episode. `connect_s` is the time limit for
    /// connecting, in seconds.
    pub fn remedy(&self, connect_s: f64) -> Option<String> {
        match self {
            RemoteError::Unreachable { .. } => Some(format!(
                "Start its server, or name in --policy where it listens (a server that starts slowly is waited for longer with a \
                 greater connect_s in its policy map, now {connect_s} s)"
            )),
            // No setting of a map can make the first answer faster.
            RemoteError::Slow { .. } => {
                Some("That is as long as a first answer may take; see what its server does".into())
            }
            RemoteError::Gone { .. }
            | RemoteError::Failed { .. }
            | RemoteError::Unreadable { .. }
            | RemoteError::Misfit(_) => None,
        }
    }
}

/// Returns the most informative line of a text, shortened: the last line of a Python traceback, otherwise the
/// first line. For an HTML page, it returns the beginning, because its first line is a tag.
pub fn gist(text: &str) -> String {
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let line = match (text.starts_with("Traceback"), text.trim_start().starts_with('<')) {
        (true, _) => lines.next_back().map(str::to_owned),
        (false, true) => Some(lines.collect::<Vec<_>>().join(" ")),
        (false, false) => lines.next().map(str::to_owned),
    };
    printable(&line.as_deref().unwrap_or("no text").chars().take(LONGEST_GIST_CHARS).collect::<String>())
}

const LONGEST_GIST_CHARS: usize = 300;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_traceback_is_told_by_its_last_line() {
        assert_eq!(
            gist("Traceback (most recent call last):\n  File\nKeyError: 'state'\n"),
            "KeyError: 'state'"
        );
        assert_eq!(gist("out of memory\nmore"), "out of memory");
        assert_eq!(gist(" \n"), "no text");
        let page = "<html>\r\n<head><title>502 Bad Gateway</title></head>\r\n<body>";
        assert_eq!(gist(page), "<html> <head><title>502 Bad Gateway</title></head> <body>");
        assert_eq!(gist(&"x".repeat(1000)).len(), LONGEST_GIST_CHARS);
    }
}
