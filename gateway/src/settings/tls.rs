//! The certificate for HTTPS. Headsets allow WebXR only on HTTPS pages and on pages of the device itself.

use std::{
    fmt,
    path::{Path, PathBuf},
    sync::Arc,
};

use tandem_episodes::{MAX_TEXT_BYTES, read_bytes};
use tokio_rustls::rustls::{
    self, ServerConfig,
    crypto::ring,
    pki_types::{
        CertificateDer, PrivateKeyDer,
        pem::{self, PemObject},
    },
    version::TLS13,
};

/// Advice on creating a certificate, for a server called `lab.example`.
const MAKES_ONE: &str = "`openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 365 -subj /CN=lab.example \
     -addext subjectAltName=DNS:lab.example -keyout key.pem -out cert.pem` makes both";

/// A certificate with its private key.
#[derive(Clone)]
pub struct Certificate(pub Arc<ServerConfig>);

/// Reason why HTTPS cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// Only one of the two files is given.
    #[error("HTTPS needs a certificate and its key; give {missing} FILE, too; {MAKES_ONE}")]
    Half {
        /// Name of the missing flag.
        missing: &'static str,
    },
    /// A file cannot be read, or is not in PEM format.
    #[error("cannot read {what} in {}: {source}; {MAKES_ONE}", .path.display())]
    Unreadable {
        /// Expected content.
        what: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Error of the parser.
        source: pem::Error,
    },
    /// A PEM file has no certificate.
    #[error("{} holds no certificate; {MAKES_ONE}", .path.display())]
    NoCertificate {
        /// Path of the file.
        path: PathBuf,
    },
    /// The certificate and the key do not match, or cannot be used.
    #[error(
        "the key in {} is not that of the certificate in {}: {source}; {MAKES_ONE}",
        .key.display(), .certificate.display()
    )]
    Mismatch {
        /// Path of the certificate.
        certificate: PathBuf,
        /// Path of the key.
        key: PathBuf,
        /// Error of the TLS library.
        source: rustls::Error,
    },
}

impl Certificate {
    /// Reads a certificate chain and its key. Both files have to be given, or neither.
    pub fn of(certificate: Option<&Path>, key: Option<&Path>) -> Result<Option<Certificate>, TlsError> {
        match (certificate, key) {
            (Some(certificate), Some(key)) => Certificate::read(certificate, key).map(Some),
            (None, None) => Ok(None),
            (Some(_), None) => Err(TlsError::Half { missing: "--tls-key" }),
            (None, Some(_)) => Err(TlsError::Half { missing: "--tls-cert" }),
        }
    }

    fn read(certificate: &Path, key: &Path) -> Result<Certificate, TlsError> {
        let read = |path: &Path| read_bytes(path, MAX_TEXT_BYTES).map_err(pem::Error::Io);
        let chain = read(certificate)
            .and_then(|bytes| CertificateDer::pem_slice_iter(&bytes).collect::<Result<Vec<_>, _>>())
            .map_err(unreadable("the certificate", certificate))?;
        if chain.is_empty() {
            return Err(TlsError::NoCertificate { path: certificate.into() });
        }
        let secret = read(key)
            .and_then(|bytes| PrivateKeyDer::from_pem_slice(&bytes))
            .map_err(unreadable("the private key", key))?;
        ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_protocol_versions(&[&TLS13])
            .and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, secret))
            .map(|config| Certificate(Arc::new(config)))
            .map_err(|source| TlsError::Mismatch { certificate: certificate.into(), key: key.into(), source })
    }
}

fn unreadable(what: &'static str, path: &Path) -> impl FnOnce(pem::Error) -> TlsError {
    let path = path.to_owned();
    move |source| TlsError::Unreadable { what, path, source }
}

impl fmt::Debug for Certificate {
    fn fmt(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.write_str("Certificate(..)")
    }
}
