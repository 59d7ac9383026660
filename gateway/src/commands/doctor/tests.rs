//! Tests of `doctor`: its findings on settings that work and on settings that do not.

use std::{
    fs,
    net::TcpListener,
    path::Path,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use clap::Parser;

use super::*;

#[derive(Debug, Parser)]
struct DoctorLine {
    #[command(flatten)]
    args: DoctorArgs,
}

/// Returns the findings on the subject `what` with these flags.
fn found(flags: &[&str], what: &str) -> Vec<Finding> {
    found_with(Ok(None), flags, what)
}

/// Does the same as [`found`], with `token` in the environment.
fn found_with(token: Result<Option<Token>, String>, flags: &[&str], what: &str) -> Vec<Finding> {
    let line = DoctorLine::try_parse_from([&["doctor"], flags].concat()).unwrap();
    let findings = examine(line.args.serve, token).into_iter();
    findings.filter(|(about, _)| *about == what).map(|(_, finding)| finding).collect()
}

#[track_caller]
fn expect_wrong(findings: &[Finding], says: &[&str]) {
    let wrong = findings.iter().find_map(|finding| match finding {
        Finding::Wrong(text) => Some(text),
        Finding::Works(_) | Finding::Note(_) => None,
    });
    let wrong = wrong.unwrap_or_else(|| panic!("nothing is wrong: {findings:?}"));
    says.iter().for_each(|part| assert!(wrong.contains(part), "{wrong}"));
}

#[test]
fn a_port_that_is_taken_and_a_folder_that_cannot_be_written_say_what_to_do() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    assert!(machine::port(address).unwrap_err().contains("give another --listen"));
    drop(taken);
    assert!(machine::port(address).is_ok());

    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("file");
    fs::write(&file, "no folder").unwrap();
    assert!(machine::runs(&file.join("runs")).unwrap_err().contains("give another --runs"));
    assert_eq!(fs::read_to_string(&file).unwrap(), "no folder");
}

#[test]
fn looking_leaves_nothing_behind() {
    let place = tempfile::tempdir().unwrap();
    let (new, kept) = (place.path().join("new"), place.path().join("kept"));
    fs::create_dir(&kept).unwrap();
    assert!(machine::runs(&new).is_ok() && machine::runs(&kept).is_ok());
    assert!(machine::runs(&new.join("a/b")).is_ok() && machine::runs(&kept.join("a/b")).is_ok());
    assert!(!new.exists() && kept.exists());
    assert_eq!(fs::read_dir(&kept).unwrap().count(), 0);
}

#[test]
fn the_file_of_settings_and_all_that_it_names_are_tried() {
    let place = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = place.path().join(name);
        fs::write(&path, text).unwrap();
        path.to_string_lossy().into_owned()
    };
    let words = write("words.json", r#"{"handover": {"joint": ""}}"#);
    let text = format!(
        "listen = \"0.0.0.0:0\"\nmax_episodes = 0\ninstructions = {words:?}\nscene = \"no.xml\"\nlocomotion = \"no.onnx\"\n"
    );
    let config = write("settings.toml", &text);
    let flags = ["--config", &config, "--runs", "/dev/null/runs"];
    expect_wrong(&found(&flags, "limits"), &["max_episodes is 0", "for example 8"]);
    expect_wrong(&found(&flags, "token"), &["other machines reach", "--token-file"]);
    expect_wrong(&found(&flags, "instructions"), &["handover.joint is empty"]);
    expect_wrong(&found(&flags, "locomotion"), &["no.onnx"]);
    expect_wrong(&found(&flags, "scene"), &["no.xml"]);
    expect_wrong(&found(&flags, "runs"), &["give another --runs"]);
    assert!(matches!(found(&flags, "config")[..], [Finding::Works(_)]));

    let config = write("token.toml", "token_file = \"no token\"\n");
    expect_wrong(&found(&["--config", &config], "token"), &["no token"]);
    // A server also accepts the token of the environment.
    let (token, _) = Token::random().unwrap();
    assert!(matches!(found_with(Ok(Some(token)), &["--config", &config], "token")[..], [Finding::Works(_)]));

    let wrong = write("wrong.toml", "max_episode = 3\n");
    expect_wrong(&found(&["--config", &wrong], "config"), &["`max_episodes`"]);
    expect_wrong(&found(&["--config", "/nowhere.toml"], "config"), &["/nowhere.toml"]);
    assert!(matches!(found(&["--config", &wrong], "cores")[..], [_]), "the rest is tried all the same");
}

#[test]
fn a_certificate_is_tried_with_its_key() {
    let place = tempfile::tempdir().unwrap();
    let [certificate, key, other] = ["cert.pem", "key.pem", "other.pem"].map(|name| place.path().join(name));
    let made = [(); 2].map(|()| rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap());
    fs::write(&certificate, made[0].cert.pem()).unwrap();
    fs::write(&key, made[0].signing_key.serialize_pem()).unwrap();
    fs::write(&other, made[1].signing_key.serialize_pem()).unwrap();
    let [certificate, key, other] = [certificate, key, other].map(|path| path.to_string_lossy().into_owned());

    let tried = |certificate: &str, key: &str| found(&["--tls-cert", certificate, "--tls-key", key], "tls");
    assert!(matches!(tried(&certificate, &key)[..], [Finding::Works(_)]));
    expect_wrong(&tried(&certificate, &other), &["other.pem is not that of the certificate", "openssl req"]);
    expect_wrong(&tried(&certificate, "nowhere.pem"), &["the private key in nowhere.pem"]);
    expect_wrong(&tried(&key, &key), &["key.pem holds no certificate"]);
    expect_wrong(&found(&["--tls-cert", &certificate], "tls"), &["give --tls-key FILE"]);
    assert!(found(&[], "tls").is_empty());
}

#[test]
fn what_is_told_of_several_lines_stands_under_its_first() {
    let findings = vec![
        ("config", Finding::Wrong("no TOML\n  |\n1 | x\n".into())),
        ("cores", Finding::Works("2".into())),
    ];
    let space = " ".repeat(21);
    let expected =
        format!("config        WRONG  no TOML\n{space}  |\n{space}1 | x\ncores         ok     2\n");
    assert_eq!(told(&findings), expected);
}

#[test]
fn a_scene_is_tried_with_what_tasks_need_of_it() {
    let place = tempfile::tempdir().unwrap();
    let kitchen = Path::new(env!("CARGO_MANIFEST_DIR")).join("../episodes/tests/scenes/kitchen");
    let bare = place.path().join("bare.xml");
    fs::write(&bare, r#"<mujoco><worldbody><geom type="plane" size="5 5 0.1"/></worldbody></mujoco>"#)
        .unwrap();
    expect_wrong(&found(&["--scene", bare.to_str().unwrap()], "scene"), &["no site \"task\"", "give it one"]);

    let handover = kitchen.join("handover.xml");
    let findings = found(&["--scene", handover.to_str().unwrap()], "scene");
    let works = |finding: &Finding| matches!(finding, Finding::Works(text) if text.contains("handover.xml holds handover"));
    assert!(findings.iter().any(works), "{findings:?}");
    let note = |finding: &Finding| matches!(finding, Finding::Note(text) if text.contains("frame_hang cannot be played"));
    assert!(findings.iter().any(note), "{findings:?}");
    assert!(
        found(&["--scene", handover.to_str().unwrap()], "physics")
            .iter()
            .all(|finding| matches!(finding, Finding::Works(_)))
    );
}

#[track_caller]
fn expect_note(finding: &Finding, says: &[&str]) {
    let Finding::Note(text) = finding else { panic!("no note: {finding:?}") };
    says.iter().for_each(|part| assert!(text.contains(part), "{text}"));
}

#[test]
fn a_proxy_that_would_get_requests_for_this_machine_is_noted_without_its_password() {
    let check = |set: &[(&str, &str)]| {
        around::proxy(|name| set.iter().find(|(known, _)| *known == name).map(|(_, text)| text.to_string()))
    };
    let proxy = ("HTTP_PROXY", "http://me:secret@proxy:3128");
    assert_eq!(check(&[("NO_PROXY", "")]), Finding::Works("none is set".into()));
    assert_eq!(check(&[("HTTP_PROXY", " ")]), Finding::Works("none is set".into()));
    expect_note(&check(&[proxy]), &["HTTP_PROXY is set", "lacks 127.0.0.1 and localhost", "export NO_PROXY"]);
    expect_note(&check(&[("https_proxy", "http://proxy")]), &["HTTPS_PROXY is set"]);
    expect_note(&check(&[proxy, ("no_proxy", "localhost, example.org")]), &["lacks 127.0.0.1:"]);
    for direct in ["localhost, 127.0.0.1", "*"] {
        assert!(matches!(check(&[proxy, ("NO_PROXY", direct)]), Finding::Works(_)), "{direct}");
    }
    assert!(!format!("{:?}", check(&[proxy])).contains("secret"));
}

#[test]
fn a_full_disk_and_a_date_before_the_program_are_found() {
    assert!(matches!(around::disk(Some(around::MIN_FREE_BYTES)), Finding::Works(_)));
    expect_note(&around::disk(Some(around::MIN_FREE_BYTES - 1)), &["5.0 GB", "give another --runs"]);
    expect_note(&around::disk(None), &["not known on this system"]);
    #[cfg(unix)]
    assert!(around::free_bytes(Path::new("no/such/folder")).is_some_and(|free_bytes| free_bytes > 0));

    let (written, day) = (UNIX_EPOCH + around::PROGRAM_DATE, Duration::from_secs(86_400));
    assert!(matches!(around::date(written - day, None), Finding::Works(_)));
    expect_wrong(&[around::date(written - 2 * day, None)], &["2.0 days before", "timedatectl"]);
    let built = SystemTime::now();
    assert!(matches!(around::date(built, Some(built)), Finding::Works(_)));
    expect_wrong(&[around::date(built - 400 * day, Some(built))], &["400.0 days before"]);
}

#[test]
fn other_programs_that_are_missing_are_noted() {
    expect_note(&around::ffmpeg("/no/ffmpeg"), &["FILE.mp4", "FILE.webp"]);
    expect_note(&around::python("/no/python"), &["/no/python cannot be started", "TANDEM_PYTHON"]);
    expect_note(&around::installed("py", "3.11.7 openai av\n"), &["py (3.11.7)", "pip install tandem-sim"]);

    let some = around::installed("py", "3.12.1 tandem anthropic openai gymnasium av pyarrow\n");
    let says =
        "has tandem with the extras agents,gym,lerobot; pip install 'tandem-sim[baselines]' adds the others";
    assert_eq!(some, Finding::Works(format!("py (3.12.1) {says}")));
    let Finding::Works(none) = around::installed("py", "3.12.1 tandem") else { panic!("it has tandem") };
    assert!(none.contains("'tandem-sim[agents,gym,lerobot,baselines]'") && !none.contains("with"), "{none}");
}

#[cfg(unix)]
#[test]
fn an_interpreter_is_asked_and_its_failure_is_shown() {
    use std::os::unix::fs::PermissionsExt;
    let place = tempfile::tempdir().unwrap();
    let script = |name: &str, text: &str| {
        let path = place.path().join(name);
        fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        path.to_string_lossy().into_owned()
    };
    let films = script("ffmpeg", "echo 'ffmpeg version 7.1-x Copyright'");
    assert_eq!(around::ffmpeg(&films), Finding::Works("version 7.1-x makes MP4 of films".into()));
    let asked = script("asked", "shift 2; echo 3.13.0 $1 $2 $3");
    assert_eq!(around::python(&asked), around::installed(&asked, "3.13.0 tandem anthropic openai"));
    let broken = script("broken", "echo 'ImportError: _native' >&2; exit 1");
    expect_note(&around::python(&broken), &["ImportError: _native", "--force-reinstall tandem-sim"]);
}

#[test]
fn the_extras_are_those_of_the_wheel() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/pyproject.toml");
    let wheel: toml::Table = fs::read_to_string(path).unwrap().parse().unwrap();
    for (name, modules) in around::EXTRAS {
        let packages: Vec<&str> = wheel["project"]["optional-dependencies"][name]
            .as_array()
            .unwrap()
            .iter()
            .map(|package| package.as_str().unwrap().split(['>', '=', '<']).next().unwrap())
            .collect();
        assert_eq!(packages, modules, "{name}");
    }
}
