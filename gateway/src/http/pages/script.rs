//! The script of all pages. It is embedded with gzip, which all browsers accept.

use std::{io::Read, sync::LazyLock};

use axum::{
    http::{HeaderMap, HeaderValue, header},
    response::Response,
};
use flate2::read::GzDecoder;

const PACKED: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/page.js.gz"));

/// The script for clients that do not accept gzip.
static PLAIN: LazyLock<String> = LazyLock::new(|| {
    let mut text = String::new();
    GzDecoder::new(PACKED).read_to_string(&mut text).expect("the build has packed a text");
    text
});

/// Returns the script, compressed if the client accepts gzip.
pub(super) async fn script(headers: HeaderMap) -> Response {
    const KIND: &str = "text/javascript; charset=utf-8";
    let mut response = if takes_gzip(&headers) {
        let mut packed = super::asset(KIND, PACKED);
        packed.headers_mut().insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
        packed
    } else {
        super::asset(KIND, PLAIN.as_str())
    };
    response.headers_mut().insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    response
}

fn takes_gzip(headers: &HeaderMap) -> bool {
    let lists = headers.get_all(header::ACCEPT_ENCODING).into_iter().filter_map(|list| list.to_str().ok());
    lists.flat_map(|list| list.split(',')).any(|coding| {
        let (name, weight) = coding.split_once(";q=").unwrap_or((coding, "1"));
        name.trim() == "gzip" && weight.trim().parse::<f32>().is_ok_and(|weight| weight > 0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked_with(codings: &'static str) -> HeaderMap {
        HeaderMap::from_iter([(header::ACCEPT_ENCODING, HeaderValue::from_static(codings))])
    }

    #[test]
    fn gzip_goes_only_to_clients_that_take_it() {
        for codings in ["gzip", "gzip, deflate, br, zstd", "br;q=1.0, gzip;q=0.5"] {
            assert!(takes_gzip(&asked_with(codings)), "{codings}");
        }
        for codings in ["", "identity", "br", "gzip;q=0", "x-gzip-like"] {
            assert!(!takes_gzip(&asked_with(codings)), "{codings}");
        }
        assert!(!takes_gzip(&HeaderMap::new()));
    }

    #[test]
    fn the_packed_script_is_the_committed_one() {
        assert_eq!(PLAIN.as_str(), include_str!("../../../web/dist/page.js"));
    }
}
