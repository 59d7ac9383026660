//! Tests of the program's information about itself, and of settings with which it refuses to serve.

use std::{
    fs,
    net::TcpListener,
    process::{Command, Output, Stdio},
};

use serde_json::Value;

/// Runs `tandem` to its end with these arguments and environment variables.
fn tandem(args: &[&str], variables: &[(&str, &str)]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_tandem"));
    program.args(args).envs(variables.iter().copied()).output().expect("the program starts")
}

#[track_caller]
fn told(output: Output) -> String {
    let [told, failed] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("text"));
    assert!(output.status.success(), "{}: {failed}\n{told}", output.status);
    told
}

/// Returns the standard error of a program that failed.
#[track_caller]
fn refused(output: Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "it worked: {text}");
    assert!(!text.contains("panicked"), "{text}");
    text
}

#[test]
fn a_token_that_is_set_and_empty_is_refused() {
    let serve = ["serve", "--listen", "127.0.0.1:0", "--runs", "/dev/null/runs"];
    let text = refused(tandem(&serve, &[("TANDEM_TOKEN", "")]));
    assert!(text.contains("TANDEM_TOKEN is set and empty") && text.contains("unset it"), "{text}");
    for (args, variables) in [
        (vec!["--token-file", ""], vec![]),
        (vec![], vec![("TANDEM_TOKEN_FILE", "")]),
        (vec!["--token", ""], vec![]),
        (vec!["--token-file", "/dev/null"], vec![]),
        (vec!["--max-episodes", "0"], vec![]),
        (vec![], vec![("TANDEM_MAX_EPISODES", "0")]),
    ] {
        let text = refused(tandem(&[&serve[..], &args].concat(), &variables));
        let says = ["token", "max_episodes is 0"];
        assert!(says.iter().any(|part| text.contains(part)), "{args:?} {variables:?}: {text}");
    }
}

#[test]
fn the_doctor_takes_what_the_server_takes_and_fails_with_it() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let config = place.path().join("settings.toml");
    let doctor = |settings: &str, variables: &[(&str, &str)]| {
        fs::write(&config, settings).expect("a file of settings");
        let runs = place.path().join("runs");
        let flags = ["doctor", "--log-format", "json", "--listen", "127.0.0.1:0", "--runs"];
        let named = [runs.to_str().expect("a name"), "--config", config.to_str().expect("a name")];
        tandem(&[&flags[..], &named].concat(), variables)
    };
    let works = told(doctor("disclosure = \"end\"\n", &[]));
    assert!(!works.contains("WRONG") && works.contains("settings.toml is read"), "{works}");
    let missing =
        [("PATH", ""), ("TANDEM_PYTHON", "/no/python"), ("HTTP_PROXY", "http://p"), ("NO_PROXY", "")];
    let noted = told(doctor("", &missing));
    for subject in ["ffmpeg", "python", "proxy"] {
        assert!(noted.contains(&format!("{subject:14}note")), "{subject}: {noted}");
    }
    assert!(noted.contains("disk          ") && noted.contains("date          ok"), "{noted}");
    for (settings, variables, says) in [
        ("scene = \"nowhere.xml\"\n", &[][..], "nowhere.xml"),
        ("instructions = \"nowhere.json\"\n", &[], "nowhere.json"),
        ("max_requests = 0\n", &[], "max_requests is 0"),
        ("max_requests = \"many\"\n", &[], "max_requests"),
        ("", &[("TANDEM_TOKEN", "")], "set and empty"),
    ] {
        let found = doctor(settings, variables);
        let text = String::from_utf8_lossy(&found.stdout).into_owned();
        assert!(!found.status.success() && !text.contains("panicked"), "{settings}: {text}");
        let wrong: Vec<&str> = text.lines().filter(|line| line.contains("WRONG")).collect();
        assert!(wrong.len() == 1 && text.contains(says), "{settings}: {text}");
        assert!(text.contains("cores"), "it goes on after what is wrong: {text}");
    }
}

#[test]
fn shells_manuals_and_programs_are_told_what_there_is() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = told(tandem(&["completions", shell], &[]));
        assert!(script.contains("max-episodes") && script.contains("completions"), "{shell}: {script}");
    }
    let page = told(tandem(&["man"], &[]));
    assert!(page.contains(".TH tandem 1") && page.contains("tandem\\-serve(1)"), "{page}");
    let place = tempfile::tempdir().expect("a temporary folder");
    let folder = place.path().join("man1");
    assert_eq!(told(tandem(&["man", "--out", folder.to_str().expect("a name")], &[])), "");
    for (name, says) in
        [("tandem", "doctor"), ("tandem-serve", "max\\-episodes"), ("tandem-locomotion-bench", "seeds")]
    {
        let page = fs::read_to_string(folder.join(format!("{name}.1"))).expect(name);
        assert!(page.contains(says), "{name}: {page}");
    }
    refused(tandem(&["man", "--out", "/dev/null/man"], &[]));

    let tasks: Value = serde_json::from_str(&told(tandem(&["tasks", "--json"], &[]))).expect("JSON");
    assert_eq!(tasks["tasks"][0]["phases"][2]["id"], "place");
    let of_suite = |suite: Value| {
        let tasks = tasks["tasks"].as_array().expect("a list");
        tasks.iter().filter(|task| task["suite"] == suite).count()
    };
    assert_eq!((of_suite(Value::Null), of_suite("tandem+".into())), (10, 5));
    assert!(told(tandem(&["tasks"], &[])).contains("  p3 place (alone): "));
}

#[test]
fn readers_that_have_read_enough_are_no_failure() {
    let bench = ["locomotion", "bench", "--cases", "stand_1kg", "--seeds", "0"];
    for args in [&["tasks"][..], &["tasks", "--json"], &["man"], &["completions", "bash"], &bench] {
        let program = Command::new(env!("CARGO_BIN_EXE_tandem"))
            .args(args)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let mut program = program.expect("the program starts");
        drop(program.stdout.take());
        let output = program.wait_with_output().expect("its end");
        assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn the_demo_reaches_its_own_server_past_a_proxy_that_answers_nothing() {
    let silent = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let proxy = format!("http://{}", silent.local_addr().expect("an address"));
    let runs = tempfile::tempdir().expect("a temporary folder");
    let runs = runs.path().to_str().expect("UTF-8");
    let variables = ["HTTP_PROXY", "http_proxy", "ALL_PROXY"].map(|name| (name, proxy.as_str()));
    let output = tandem(&["demo", "--seeds", "2000", "--runs", runs], &variables);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("  p1 grasp_and_lift reached"), "{text}");
}
