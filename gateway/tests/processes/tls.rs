//! Tests of HTTPS, with a certificate that is made for the test.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::{TcpListener, TcpStream},
    path::Path,
    process::{Child, Command, Stdio},
    sync::{Arc, mpsc},
    thread,
};

use tokio_rustls::rustls::{
    ClientConfig, ClientConnection, RootCertStore, ServerConfig, ServerConnection, StreamOwned,
    crypto::ring,
    pki_types::{CertificateDer, PrivateKeyDer},
};
use tungstenite::{
    Message,
    handshake::server::{Request, Response},
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
        let links = BufReader::new(child.stdout.take().unwrap()).lines().take(3).map(Result::unwrap);
        let links: Vec<String> = links.collect();
        let (address, watch_key) = links
            .iter()
            .find_map(|link| link.strip_prefix("watch at https://")?.split_once("/watch#"))
            .unwrap_or_else(|| panic!("no link of HTTPS: {links:?}"));
        Encrypted {
            address: address.into(),
            watch_key: watch_key.into(),
            child,
            client: trusting(made.cert.der()),
        }
    }

    /// Returns the answer to a request without a body.
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

/// Returns a client that trusts one certificate.
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

/// Authorization that a policy's server received, and the output of `tandem evaluate` after the server's
/// error.
struct Asked {
    authorization: String,
    said: String,
}

/// A connection of a policy's server.
type Secured = StreamOwned<ServerConnection, TcpStream>;

/// Runs an evaluation with a policy on an encrypted server, whose connections `serve` answers. The evaluation
/// trusts the server's certificate if `trusts` is true.
fn ask_policy(protocol: &str, scheme: &str, trusts: bool, serve: fn(Secured) -> String) -> Asked {
    let place = tempfile::tempdir().unwrap();
    let made = rcgen::generate_simple_self_signed(["127.0.0.1".to_owned()]).unwrap();
    std::fs::write(place.path().join("cert.pem"), made.cert.pem()).unwrap();
    std::fs::write(place.path().join("key.txt"), "secret-of-mine\n").unwrap();
    let map = "preset = \"openpi\"\nconnect_s = 0.0\nreply_s = 20.0\n";
    std::fs::write(place.path().join("map.toml"), map).unwrap();
    let key = PrivateKeyDer::try_from(made.signing_key.serialize_der()).unwrap();
    let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_no_client_auth()
        .with_single_cert(vec![made.cert.der().clone()], key)
        .unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let (tell, told) = mpsc::channel();
    thread::spawn(move || {
        let config = Arc::new(config);
        for stream in listener.incoming() {
            let mut stream =
                StreamOwned::new(ServerConnection::new(config.clone()).unwrap(), stream.unwrap());
            if stream.conn.complete_io(&mut stream.sock).is_ok() {
                let _ = tell.send(serve(stream));
            }
        }
    });
    // This proxy accepts connections and never answers. Local servers must be reached without it.
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let proxy = format!("http://{}", silent.local_addr().unwrap());
    let mut program = Command::new(env!("CARGO_BIN_EXE_tandem"));
    program
        .args([
            "evaluate",
            "--protocol",
            "benchmark",
            "--tasks",
            "handover",
            "--seeds",
            "2000",
            "--out",
            "out",
        ])
        .args(["--policy-map", "map.toml", "--policy-key-file", "key.txt", "--policy"])
        .arg(format!("{protocol}:{scheme}://{address}/act"))
        .envs(["HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"].map(|name| (name, &proxy)))
        .current_dir(place.path());
    if trusts {
        program.env("SSL_CERT_FILE", "cert.pem");
    }
    let output = program.output().unwrap();
    let said =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    Asked { authorization: told.try_recv().unwrap_or_default(), said }
}

/// Serves openpi's protocol: sends the metadata, then an error.
#[expect(clippy::result_large_err, reason = "tungstenite's callback has this type")]
fn serve_openpi(stream: Secured) -> String {
    let mut authorization = String::new();
    let keep = |request: &Request, response: Response| {
        authorization = request.headers()["authorization"].to_str().unwrap().to_owned();
        Ok(response)
    };
    let mut socket = tungstenite::accept_hdr(stream, keep).unwrap();
    socket.send(Message::binary(b"\x80".to_vec())).unwrap();
    while !socket.read().unwrap().is_binary() {}
    socket.send(Message::text("no weights")).unwrap();
    let _ = socket.read();
    authorization
}

/// Answers a request for `/act` with an error.
fn serve_act(stream: Secured) -> String {
    let mut reader = BufReader::new(stream);
    let (mut authorization, mut length) = (String::new(), 0);
    loop {
        let mut line = String::new();
        reader.read_line(&mut line).unwrap();
        match line.trim().split_once(": ") {
            Some((name, value)) if name.eq_ignore_ascii_case("authorization") => authorization = value.into(),
            Some((name, value)) if name.eq_ignore_ascii_case("content-length") => {
                length = value.parse().unwrap()
            }
            Some(_) => {}
            None if line.trim().is_empty() => break,
            None => {}
        }
    }
    reader.read_exact(&mut vec![0; length]).unwrap();
    let answer = "HTTP/1.1 500 No\r\ncontent-length: 10\r\nconnection: close\r\n\r\nno weights";
    reader.get_mut().write_all(answer.as_bytes()).unwrap();
    authorization
}

#[test]
fn policies_are_asked_encrypted_and_with_their_key() {
    let openpi = ask_policy("openpi", "wss", true, serve_openpi);
    assert!(openpi.said.contains("failed: no weights"), "{}", openpi.said);
    assert_eq!(openpi.authorization, "Api-Key secret-of-mine");
    let act = ask_policy("act", "https", true, serve_act);
    assert!(act.said.contains("no weights"), "{}", act.said);
    assert_eq!(act.authorization, "Bearer secret-of-mine");
    for asked in
        [ask_policy("openpi", "wss", false, serve_openpi), ask_policy("act", "https", false, serve_act)]
    {
        assert!(asked.said.contains("certificate"), "{}", asked.said);
        assert_eq!(asked.authorization, "", "nobody who is not trusted sees the key");
    }
}

#[test]
fn a_key_is_sent_to_nobody_who_could_be_overheard() {
    let place = tempfile::tempdir().unwrap();
    let launched = |key: &str, policy: &str| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_tandem"));
        let flags =
            ["evaluate", "--tasks", "handover", "--seeds", "2000", "--out", "out", "--policy-map", "openpi"];
        let ended = program.args(flags).args(["--policy", policy]).env("TANDEM_POLICY_KEY", key);
        let ended = ended.current_dir(place.path()).output().unwrap();
        assert!(!ended.status.success());
        String::from_utf8(ended.stderr).unwrap()
    };
    for (policy, says) in [
        ("openpi:ws://a.example:1", "give openpi:wss://HOST"),
        ("act:http://a.example/act", "give act:https://HOST"),
    ] {
        let said = launched("secret-of-mine", policy);
        assert!(said.contains(says) && !said.contains("secret"), "{said}");
    }
    let said = launched("", "openpi:wss://a.example");
    assert!(said.contains("TANDEM_POLICY_KEY has to be one line"), "{said}");
}
