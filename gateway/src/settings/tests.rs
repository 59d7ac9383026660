//! Tests of the precedence of settings and of invalid ones.

use super::*;

#[test]
fn flags_come_before_the_file_and_the_file_before_defaults() {
    let path = std::env::temp_dir().join(format!("tandem-settings-{}.toml", std::process::id()));
    std::fs::write(&path, "max_episodes = 3\nmax_body_bytes = 5\n").unwrap();
    let flags = Layer { max_body_bytes: Some(7), ..Layer::default() };
    let settings = Settings::resolve(flags, Some(&path)).unwrap();
    assert_eq!((settings.max_body_bytes, settings.max_episodes, settings.listen.port()), (7, 3, 8700));

    std::fs::write(&path, "max_episode = 3\n").unwrap();
    let text = Settings::resolve(Layer::default(), Some(&path)).unwrap_err().to_string();
    assert!(text.contains("max_episode`") && text.contains("`max_episodes`"), "{text}");

    let flags = Layer { locomotion: Some(path.clone()), ..Layer::default() };
    let text = Settings::resolve(flags, None).unwrap_err().to_string();
    assert!(text.contains("ONNX") && text.contains("tandem-settings"), "{text}");
    std::fs::remove_file(&path).unwrap();
    assert!(Settings::resolve(Layer::default(), Some(&path)).is_err());
}

#[test]
fn an_address_that_others_reach_needs_a_token() {
    let token = || Token::parse("0123456789abcdef", "a test").unwrap();
    let resolve = |listen: &str, token: Option<Token>| {
        let flags = Layer { listen: Some(listen.parse().unwrap()), token, ..Layer::default() };
        Settings::resolve(flags, None)
    };
    for listen in ["127.0.0.1:0", "127.9.9.9:0", "[::1]:0", "[::ffff:127.0.0.1]:0"] {
        assert!(resolve(listen, None).is_ok(), "{listen}");
    }
    for listen in ["0.0.0.0:0", "[::]:0", "10.0.0.5:8700", "[fe80::1]:0"] {
        let refused = resolve(listen, None).unwrap_err().to_string();
        assert!(refused.contains("--token-file") && refused.contains("TANDEM_TOKEN"), "{refused}");
        assert!(resolve(listen, Some(token())).is_ok(), "{listen}");
    }
    let both = Layer { token_file: Some("x".into()), token: Some(token()), ..Layer::default() };
    assert!(matches!(Settings::resolve(both, None), Err(SettingsError::TwoTokens)));
    let missing = Layer { token_file: Some("/nowhere/token".into()), ..Layer::default() };
    let refused = Settings::resolve(missing, None).unwrap_err().to_string();
    assert!(refused.contains("/nowhere/token"), "{refused}");
}

#[test]
fn settings_that_let_nobody_in_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("settings.toml");
    let check = |line: &str, says: &[&str]| {
        std::fs::write(&path, line).unwrap();
        let text = Settings::resolve(Layer::default(), Some(&path)).unwrap_err().to_string();
        says.iter().for_each(|part| assert!(text.contains(part), "{line}: {text}"));
    };
    check("max_episodes = 0", &["max_episodes is 0", "at least 1, for example 8"]);
    for limit in
        ["max_body_bytes", "request_timeout", "max_requests", "rate_limit", "idle_timeout", "thinking_limit"]
    {
        check(&format!("{limit} = 0"), &[limit, "at least 1"]);
    }
    for host in ["", "http://lab.example", "lab.example:8700", "lab..example", "a b"] {
        check(&format!("allowed_host = [{host:?}]"), &["no name of a host", "for example lab.example"]);
    }
    check("token_file = \"\"", &["token_file is set and empty", "openssl"]);
    check("token = \"\"", &["unknown field `token`", "`token_file`"]);
    let most = Layer { max_requests: Some(usize::MAX), stop_timeout: Some(0), ..Layer::default() };
    let hosts = Some(["lab.example", "lab", "10.0.0.5", "fe80::1"].map(String::from).into());
    assert!(Settings::resolve(Layer { allowed_host: hosts, ..most }, None).is_ok());
}
