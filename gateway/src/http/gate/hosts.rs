//! Checks of the host and origin of requests.
//!
//! Browsers let any web page send requests to this machine. Foreign pages are kept out because they
//! cannot forge `Host` and `Origin`.

use std::{net::IpAddr, sync::Arc};

use axum::http::{HeaderMap, Uri, header, uri::Authority};

use crate::{http::problem::ApiError, settings::Settings};

/// Names and addresses of this server.
#[derive(Debug, Clone)]
pub struct OwnHosts {
    settings: Arc<Settings>,
    /// Address that the server is bound to.
    address: IpAddr,
}

impl OwnHosts {
    /// Returns the hosts of a server that is bound to `address`.
    pub fn new(settings: Arc<Settings>, address: IpAddr) -> OwnHosts {
        OwnHosts { settings, address }
    }

    /// Refuses a request for another host, or from a page of another origin.
    pub fn check(&self, headers: &HeaderMap, uri: &Uri) -> Result<(), ApiError> {
        let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("no text"));
        let host = text(header::HOST).or(uri.authority().map(Authority::as_str)).unwrap_or_default();
        if !self.contains(host) {
            return Err(ApiError::ForeignHost(host.into()));
        }
        // Browsers send the page's origin in Origin; other programs send none.
        match text(header::ORIGIN) {
            Some(origin) if !is_same_origin(origin, host) => Err(ApiError::ForeignOrigin(origin.into())),
            _ => Ok(()),
        }
    }

    /// Returns true if `host`, with or without a port, is a name of this server.
    ///
    /// Unknown names are refused, because a foreign page could make its own name resolve to this machine. An
    /// address cannot be redirected, so a server that listens on all addresses accepts every address.
    fn contains(&self, host: &str) -> bool {
        let Ok(authority) = host.parse::<Authority>() else { return false };
        let name = authority.host().trim_start_matches('[').trim_end_matches(']');
        if let Ok(address) = name.parse::<IpAddr>() {
            return address.is_loopback() || address == self.address || self.address.is_unspecified();
        }
        let allowed = self.settings.allowed_hosts.iter().map(String::as_str);
        allowed.chain(["localhost"]).any(|allowed| allowed.eq_ignore_ascii_case(name))
    }
}

/// Returns true if a page of `origin` came from `host` itself.
fn is_same_origin(origin: &str, host: &str) -> bool {
    let authority = ["http://", "https://"].iter().find_map(|scheme| origin.strip_prefix(scheme));
    authority.is_some_and(|authority| authority.eq_ignore_ascii_case(host))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Layer;

    fn own_hosts(address: &str) -> OwnHosts {
        let flags = Layer { allowed_host: Some(vec!["lab.example".into()]), ..Layer::default() };
        OwnHosts::new(Settings::resolve(flags, None).unwrap(), address.parse().unwrap())
    }

    #[test]
    fn hosts() {
        let check = |address: &str, ours: &[&str], foreign: &[&str]| {
            let own = own_hosts(address);
            ours.iter().for_each(|host| assert!(own.contains(host), "{address}: {host}"));
            foreign.iter().for_each(|host| assert!(!own.contains(host), "{address}: {host}"));
        };
        let always =
            ["localhost", "LOCALHOST:8700", "127.0.0.1:1", "[::1]:8700", "lab.example", "Lab.Example:80"];
        let never = [
            "",
            "evil.example",
            "localhost.evil.example",
            "evil.lab.example",
            "a b",
            "127.0.0.1.evil.example",
        ];
        for address in ["127.0.0.1", "::1", "10.0.0.5", "0.0.0.0", "::"] {
            check(address, &always, &never);
        }
        check("127.0.0.1", &[], &["10.0.0.5:8700", "[fe80::1]"]);
        check("10.0.0.5", &["10.0.0.5:8700"], &["10.0.0.6:8700"]);
        check("0.0.0.0", &["10.0.0.5:8700", "[fe80::1]:8700"], &[]);
    }

    #[test]
    fn origins() {
        let check = |origin: &str, host: &str, expected: bool| {
            assert_eq!(is_same_origin(origin, host), expected, "{origin} at {host}");
        };
        check("http://localhost:8700", "localhost:8700", true);
        check("https://Lab.Example", "lab.example", true);
        check("http://localhost:3000", "localhost:8700", false);
        check("http://localhost:8700.evil.example", "localhost:8700", false);
        check("http://evil.example", "localhost:8700", false);
        check("file://", "", false);
        check("null", "null", false);
    }
}
