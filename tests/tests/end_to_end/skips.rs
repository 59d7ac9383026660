//! A test that reports of skipped tests are visible.

use std::{env, process::Command};

use tandem_tests::skipped;

const REASON: &str = "no abacus";

#[test]
#[ignore = "a test that leaves out something, which another one starts"]
fn a_test_that_leaves_out_something() {
    println!("what a passing test prints");
    (0..2).for_each(|_| skipped(REASON));
}

#[test]
fn a_plain_run_shows_once_what_was_left_out() {
    let name = "skips::a_test_that_leaves_out_something";
    let run =
        Command::new(env::current_exe().expect("this program")).args(["--exact", name, "--ignored"]).output();
    let run = run.expect("this program again");
    let [told, shown] = [&run.stdout, &run.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert!(told.contains("1 passed") && !told.contains("what a passing test prints"), "{told}");
    assert_eq!(shown.matches(&format!("skipped: {name}: {REASON}\n")).count(), 1, "{shown}");
}
