//! Tests of the output of `evaluate` for policies that are absent, that crash, and that are played again.

use std::process::{Command, Output};

use crate::skipped::skipped;

fn evaluate(arguments: &[&str]) -> (Output, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tandem"));
    command.args(["evaluate", "--tasks", "handover", "--seeds", "2000..2001", "--protocol", "benchmark"]);
    let output = command.args(arguments).output().expect("the program starts");
    let printed = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    (output, printed.concat())
}

#[test]
fn a_server_that_is_absent_is_waited_for_in_words() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let map = folder.path().join("map.toml");
    std::fs::write(&map, "preset = \"openpi\"\nconnect_s = 6.0\n").expect("a file");
    let out = folder.path().join("out");
    let unheard =
        std::net::TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address");
    let policy = format!("openpi:ws://{unheard}");
    let [map, out] = [&map, &out].map(|path| path.to_str().expect("UTF-8"));
    let (output, printed) = evaluate(&["--policy", &policy, "--policy-map", map, "--out", out]);
    assert!(!output.status.success(), "{printed}");
    assert!(printed.contains(&format!("waiting for ws://{unheard}, ")), "{printed}");
    let error = format!("tandem: no policy answers at ws://{unheard}: ");
    assert!(printed.contains(&error) && printed.contains("of 2 episodes 0 are played and kept"), "{printed}");
}

#[cfg(unix)]
#[test]
fn programs_that_do_not_play_are_no_failures() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().to_str().expect("UTF-8");
    let (output, printed) = evaluate(&["--policy", "exec:no-such-program", "--out", out]);
    assert!(!output.status.success(), "nothing was played: {printed}");
    assert!(printed.contains("left out: handover seed 2001: the program ended without a call"), "{printed}");
    assert!(printed.contains("exit status: 127") && !printed.contains("rates in %"), "{printed}");

    let look = "curl -sf -X POST -H \"Authorization: Bearer $TANDEM_TOKEN\" -H 'content-type: application/json' -d '{\"steps\": 5}' \
                \"$TANDEM_URL/v1/episodes/$TANDEM_EPISODE/tools/wait\" > /dev/null || exit 0";
    if Command::new("curl").arg("--version").output().is_err() {
        return skipped("there is no curl");
    }
    let crash = format!("exec:{look}; echo the planner has no plan >&2; kill -KILL $$");
    let (output, printed) = evaluate(&["--policy", &crash, "--policy-name", "agent", "--out", out]);
    assert!(!output.status.success(), "nothing counts: {printed}");
    for says in [
        "  not counted\n",
        "  policy failed 2\n",
        "not counted, because the policy itself",
        "signal: 9",
        "no plan",
    ] {
        assert!(printed.contains(says), "no {says:?} in {printed}");
    }
    let (output, printed) =
        evaluate(&["--policy", &crash, "--policy-name", "agent", "--keep-failed", "--out", out]);
    assert!(output.status.success(), "{printed}");
    assert!(printed.contains("0 [0, 84]") && !printed.contains("not counted"), "{printed}");
}
