//! The watch key: watchers need the link that the server printed when it started.
//!
//! A policy's own token is not enough, because watchers see where objects are, which no policy may know.
//! The key is in the link's fragment, which browsers do not send. A page of the server sends it once and
//! gets a cookie.

use std::sync::Arc;

use axum::http::{HeaderMap, HeaderValue, header};

use crate::token::{Token, TokenError};

/// Name of the cookie with the key.
const COOKIE: &str = "tandem_watch";

/// Key of one server, new at each start.
#[derive(Clone)]
pub struct WatchKey(Arc<(Token, String)>);

/// Marker of a request that came with the watch key.
#[derive(Debug, Clone, Copy)]
pub struct Watcher;

/// Marker of a request of a client that may start episodes. The watch link is not enough for that.
#[derive(Debug, Clone, Copy)]
pub struct Host;

impl WatchKey {
    /// Generates a key.
    pub fn random() -> Result<WatchKey, TokenError> {
        Token::random().map(|made| WatchKey(Arc::new(made)))
    }

    /// Returns the key for the link.
    pub fn text(&self) -> &str {
        &self.0.1
    }

    /// Returns true if a request has the key: as its bearer token, or in the cookie.
    pub fn opens(&self, headers: &HeaderMap) -> bool {
        let lines = headers.get_all(header::COOKIE).into_iter().filter_map(|line| line.to_str().ok());
        let cookies = lines.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
        let bearers =
            headers.get_all(header::AUTHORIZATION).into_iter().filter_map(|line| line.to_str().ok());
        let keys = cookies.filter(|(name, _)| *name == COOKIE).map(|(_, key)| key);
        let keys = keys.chain(bearers.filter_map(|line| line.strip_prefix("Bearer ")));
        keys.fold(false, |opens, key| self.0.0.matches(key) | opens)
    }

    /// Returns the cookie for a browser that has the key. Scripts cannot read it and other sites cannot
    /// send it. It is marked `secure` over HTTPS.
    pub fn cookie(&self, secure: bool) -> Option<HeaderValue> {
        let secure = if secure { "; Secure" } else { "" };
        format!("{COOKIE}={}; Path=/watch; HttpOnly; SameSite=Strict{secure}", self.text()).parse().ok()
    }
}

impl std::fmt::Debug for WatchKey {
    fn fmt(&self, text: &mut std::fmt::Formatter) -> std::fmt::Result {
        text.write_str("WatchKey(..)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_opens_as_a_cookie_and_as_a_token() {
        let key = WatchKey::random().unwrap();
        let opens = |name: header::HeaderName, value: String| {
            key.opens(&HeaderMap::from_iter([(name, value.parse().unwrap())]))
        };
        let text = key.text().to_owned();
        assert!(opens(header::COOKIE, format!("a=b; tandem_watch={text}; c=d")));
        assert!(opens(header::AUTHORIZATION, format!("Bearer {text}")));
        for wrong in [format!("other={text}"), "tandem_watch=".into(), format!("tandem_watch={text}0")] {
            assert!(!opens(header::COOKIE, wrong.clone()), "{wrong}");
        }
        assert!(!opens(header::AUTHORIZATION, text.clone()) && !key.opens(&HeaderMap::new()));
        assert!(!format!("{key:?}").contains(&text));
    }
}
