//! Tests that run the scripts of the pages. All `sh,run` blocks of a page are one script, with its own server
//! and folder.
//!
//! `PATH` begins with a folder of three test programs: `tandem`, which is this test program; `cargo`, which
//! runs it; and `curl`, which fails on an error status.

use std::{
    env, fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::Path,
    process::{Command, Output, exit},
    thread,
    time::Instant,
};

use clap::Parser;
use tandem::{cli::Cli, settings::Layer};
use tandem_tests::{TestServer, skipped};

use super::{
    blocks::{is_installed, succeeds},
    pages::{Page, pages, root},
};

/// Address of the server in the pages.
const ADDRESS: &str = "127.0.0.1:8700";

/// Environment variable with the arguments for this program in the role of `tandem`, one per line.
const ARGUMENTS: &str = "TANDEM_DOCUMENTS_ARGUMENTS";

/// Name of the test that acts as `tandem`.
const AS_TANDEM: &str = "documents::scripts::this_program_is_tandem_where_a_script_calls_it";

/// Policy for the Python loop in a page. It keeps the robots still.
const POLICY: &str = "import numpy as np
def policy(image, state):
    return np.tile([0.0] * 34 + [0.75], (20, 1))
";

#[test]
fn scripts_of_pages_run() {
    if !is_installed("curl") {
        skipped("no curl to call a server with");
        return;
    }
    thread::scope(|scope| {
        for page in pages() {
            let script = script(&page, "sh");
            if !script.is_empty() {
                scope.spawn(move || run_script(&page, &script));
            }
        }
    });
}

#[test]
fn loops_in_python_run() {
    for page in pages() {
        let script = script(&page, "python");
        if script.is_empty() {
            continue;
        }
        let imports: String =
            script.lines().filter(|line| line.starts_with("import ")).collect::<Vec<_>>().join("\n");
        if !is_installed("python3") || !succeeds(Command::new("python3").args(["-c", &imports])) {
            let imports = imports.replace('\n', ", ");
            skipped(&format!("no python3, or not what {} asks for: {imports}", page.path.display()));
            continue;
        }
        let server = TestServer::start();
        let script = format!("{POLICY}{}", script.replace(ADDRESS, &server.address.to_string()));
        expect_success(&page, Command::new("python3").args(["-c", &script]).output());
    }
}

#[test]
fn this_program_is_tandem_where_a_script_calls_it() {
    let Ok(arguments) = env::var(ARGUMENTS) else { return };
    let cli = Cli::try_parse_from(["tandem"].into_iter().chain(arguments.lines()));
    let outcome = cli.unwrap_or_else(|error| error.exit()).run();
    let code = match outcome {
        Ok(code) if code == std::process::ExitCode::SUCCESS => 0,
        Ok(_) => 1,
        Err(error) => {
            eprintln!("tandem: {error}");
            1
        }
    };
    exit(code);
}

/// Returns all blocks of a page in one language that are to be run, joined into one text.
fn script(page: &Page, language: &str) -> String {
    let blocks =
        page.blocks().into_iter().filter(|block| block.language == language && block.purpose == "run");
    blocks.map(|block| block.text).collect()
}

fn run_script(page: &Page, script: &str) {
    if script.contains("python3 ") && !is_installed("python3") {
        skipped(&format!("no python3 for {}", page.path.display()));
        return;
    }
    let began = Instant::now();
    // Task file for the pages that call a server with a task file.
    let task_file = Some(vec![root().join("gateway/examples/tasks/pass_the_parcel.toml")]);
    let server = TestServer::with(Layer { task_file, ..Layer::default() });
    let folder = workplace();
    let path = format!("{}/bin:{}", folder.path().display(), env::var("PATH").unwrap_or_default());
    let script = script.replace(ADDRESS, &server.address.to_string());
    let mut shell = Command::new("sh");
    shell.args(["-euc", &script]).current_dir(folder.path()).env("PATH", path);
    expect_success(page, shell.output());
    println!("{}: {:.1} s", page.path.display(), began.elapsed().as_secs_f64());
}

#[track_caller]
fn expect_success(page: &Page, output: std::io::Result<Output>) {
    let output = output.expect("a program that is installed");
    let [told, failed] =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    let end = told.len().saturating_sub(2000);
    let told = told.get(end..).unwrap_or(&told);
    assert!(output.status.success(), "{}: {}\n{failed}\n{told}", page.path.display(), output.status);
}

/// Creates a folder with links to the repository's folders, and the test programs in `bin`.
fn workplace() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["episodes", "gateway", "sim", "tests"] {
        symlink(root().join(name), folder.path().join(name)).expect("a link in a temporary folder");
    }
    let bin = folder.path().join("bin");
    fs::create_dir(&bin).expect("a folder in a temporary folder");
    let own = env::current_exe().expect("this program");
    let tandem = format!(
        "{ARGUMENTS}=$(printf '%s\\n' \"$@\") exec '{}' --exact {AS_TANDEM} --nocapture --quiet",
        own.display()
    );
    write_program(&bin, "tandem", &tandem);
    write_program(&bin, "cargo", "[ \"$1 $2 $3\" = 'run --release --' ] && shift 3 && exec tandem \"$@\"");
    let curl = format!("exec '{}' --fail-with-body --max-time 100 \"$@\"", installed_path("curl"));
    write_program(&bin, "curl", &curl);
    folder
}

fn write_program(bin: &Path, name: &str, line: &str) {
    let path = bin.join(name);
    fs::write(&path, format!("#!/bin/sh\n{line}\n")).expect("a program in a temporary folder");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("a program that may be run");
}

/// Returns the path of an installed program.
fn installed_path(program: &str) -> String {
    let found = Command::new("sh").args(["-c", &format!("command -v {program}")]).output();
    let found = found.expect("a shell").stdout;
    String::from_utf8_lossy(&found).trim().to_owned()
}
