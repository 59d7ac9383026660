//! HTTPS, with a certificate that is made for the test.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::Path,
    process::{Child, Command, Stdio},
    sync::Arc,
};

use tokio_rustls::rustls::{
    ClientConfig, ClientConnection, RootCertStore, StreamOwned, crypto::ring, pki_types::CertificateDer,
};

/// A server with a certificate.
struct Encrypted {
    child: Child,
    /// `ADDRESS:PORT`.
    address: String,
    watch_key: String,
    client: Arc<ClientConfig>,
}

impl Encrypted {
    fn start(folder: &Path) -> Encrypted {
        let made = rcgen::generate_simple_self_signed(["127.0.0.1".to_owned()]).unwrap();
        std::fs::write(folder.join("cert.pem"), made.cert.pem()).unwrap();
        std::fs::write(folder.join("key.pem"), made.signing_key.serialize_pem()).unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_tandem"))
            .args(["serve", "--listen", "127.0.0.1:0", "--tls-cert", "cert.pem"])
            .env("TANDEM_TLS_KEY", "key.pem")
            .current_dir(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        let said = BufReader::new(child.stdout.take().unwrap()).lines().next().unwrap().unwrap();
        let (address, watch_key) = said
            .strip_prefix("watch at https://")
            .and_then(|link| link.split_once("/watch#"))
            .unwrap_or_else(|| panic!("no link of HTTPS: {said}"));
        Encrypted {
            address: address.into(),
            watch_key: watch_key.into(),
            child,
            client: trusting(made.cert.der()),
        }
    }

    /// The answer to a request without a body.
    fn ask(&self, request: &str, headers: &[(&str, &str)]) -> String {
        let connection = ClientConnection::new(self.client.clone(), "127.0.0.1".try_into().unwrap()).unwrap();
        let stream = TcpStream::connect(&self.address).unwrap();
        talk(StreamOwned::new(connection, stream), &self.address, request, headers)
    }
}

impl Drop for Encrypted {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A client that trusts one certificate.
fn trusting(certificate: &CertificateDer<'static>) -> Arc<ClientConfig> {
    let mut roots = RootCertStore::empty();
    roots.add(certificate.clone()).unwrap();
    let client = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()));
    let client = client.with_safe_default_protocol_versions().unwrap();
    Arc::new(client.with_root_certificates(roots).with_no_client_auth())
}

fn talk(mut stream: impl Read + Write, host: &str, request: &str, headers: &[(&str, &str)]) -> String {
    let headers: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
    write!(stream, "{request} HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n{headers}\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer to its end");
    answer
}

#[test]
fn a_server_with_a_certificate_speaks_https_alone() {
    let place = tempfile::tempdir().unwrap();
    let server = Encrypted::start(place.path());
    assert!(server.ask("GET /healthz", &[]).starts_with("HTTP/1.1 200"));
    let (own, evil) = (format!("https://{}", server.address), "https://evil.example");
    assert!(server.ask("GET /healthz", &[("origin", &own)]).starts_with("HTTP/1.1 200"));
    assert!(server.ask("GET /healthz", &[("origin", evil)]).starts_with("HTTP/1.1 403"));

    let key = format!("Bearer {}", server.watch_key);
    let entered = server.ask("POST /watch", &[("authorization", &key)]).to_lowercase();
    assert!(entered.starts_with("http/1.1 204") && entered.contains("samesite=strict; secure"), "{entered}");

    let plain = TcpStream::connect(&server.address).unwrap();
    let told = talk(plain, &server.address, "GET /healthz", &[]);
    assert!(told.starts_with("HTTP/1.1 400") && told.contains("ask for https://"), "{told}");
}

#[test]
fn files_that_are_no_certificate_and_its_key_are_refused_at_launch() {
    let place = tempfile::tempdir().unwrap();
    let launched = |flags: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_tandem"));
        let ended = program.arg("serve").args(flags).current_dir(place.path()).output().unwrap();
        assert!(!ended.status.success());
        String::from_utf8(ended.stderr).unwrap()
    };
    let half = launched(&["--tls-key", "key.pem"]);
    assert!(half.contains("give --tls-cert FILE"), "{half}");
    let missing = launched(&["--tls-key", "key.pem", "--tls-cert", "cert.pem"]);
    assert!(missing.contains("the certificate in cert.pem"), "{missing}");
}
