//! Encrypted connections to policies' servers. A server must have a certificate that this machine trusts.

use std::{io, sync::Arc};

use rustls_native_certs::load_native_certs;
use tokio_rustls::rustls::{
    ClientConfig, ClientConnection, RootCertStore, crypto::ring, pki_types::ServerName,
};
use ureq::tls::{Certificate, RootCerts, TlsConfig};

/// Error message for a machine without trusted root certificates.
const TRUSTS_NOBODY: &str = "this machine has no certificates of authorities that it trusts; install ca-certificates, or name a file \
     with the server's own in SSL_CERT_FILE";

/// Creates the client end of an encrypted connection to `host`.
pub fn encrypted(host: &str) -> io::Result<ClientConnection> {
    let mut roots = RootCertStore::empty();
    roots.add_parsable_certificates(load_native_certs().certs);
    if roots.is_empty() {
        return Err(io::Error::other(TRUSTS_NOBODY));
    }
    let name = ServerName::try_from(host.to_owned()).map_err(io::Error::other)?;
    let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .map_err(io::Error::other)?
        .with_root_certificates(roots)
        .with_no_client_auth();
    ClientConnection::new(Arc::new(config), name).map_err(io::Error::other)
}

/// Returns the TLS configuration for requests over HTTPS.
pub fn for_requests() -> TlsConfig {
    let found = load_native_certs().certs;
    let roots = found.iter().map(|certificate| Certificate::from_der(certificate).to_owned());
    TlsConfig::builder()
        .root_certs(RootCerts::from(roots))
        .unversioned_rustls_crypto_provider(Arc::new(ring::default_provider()))
        .build()
}
