//! Tests of `report` and `leaderboard` on folders of real episodes: every format, links to existing files,
//! and LaTeX that compiles.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

use crate::skipped::skipped;

/// Runs `tandem` in `folder`, checks that it succeeds, and returns its output.
#[track_caller]
fn tandem(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tandem"));
    let Output { status, stdout, stderr } =
        command.current_dir(folder).args(arguments).output().expect("the program starts");
    let printed = [stdout, stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(status.success(), "{arguments:?}: {printed}");
    printed
}

/// Plays and records one episode of Handover with a policy that does not solve it.
fn play(folder: &Path, policy: &str, out: &str) {
    let task = ["--tasks", "handover", "--seeds", "2000", "--protocol", "benchmark", "--record"];
    tandem(folder, &[&["evaluate", "--policy", policy, "--out", out], &task[..]].concat());
}

/// Returns the targets of the links in a page that are not URLs.
fn local_links(page: &str) -> Vec<&str> {
    let targets = page.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next());
    targets.filter(|target| !target.contains("://")).collect()
}

#[test]
fn a_run_is_reported_in_every_format_and_its_links_lead_to_files() {
    let place = tempfile::tempdir().expect("a temporary folder");
    play(place.path(), "idle", "runs/a run");
    let read = |name: &str| fs::read_to_string(place.path().join(name)).expect(name);
    for format in ["html", "md", "csv", "json", "tex", "episodes.csv", "svg", "times.svg"] {
        let printed = tandem(place.path(), &["report", "runs/a run", "--format", format]);
        assert!(printed.contains(&format!("report.{format}: 1 episodes")), "{printed}");
        assert!(!read(&format!("runs/a run/report.{format}")).is_empty(), "{format}");
    }

    let printed = tandem(place.path(), &["report", "runs/a run", "--format", "episodes.parquet"]);
    assert!(printed.contains("report.episodes.parquet: 1 episodes"), "{printed}");

    let report: Value = serde_json::from_str(&read("runs/a run/report.json")).expect("JSON");
    let process = &report["header"]["processes"][0];
    let command = "tandem evaluate --policy idle --out 'runs/a run' --tasks handover --seeds 2000 \
                   --protocol benchmark --record";
    assert_eq!(
        (&process["folder"], &process["command"]),
        (&"runs/a run".into(), &command.into()),
        "{process}"
    );
    assert!(process["machine"]["cores"].as_u64() > Some(0), "{process}");
    assert_eq!(report["header"]["made"]["command"], "tandem report 'runs/a run' --format json");
    assert_eq!(report["header"]["settings"][0]["build"], process["build"]);
    let hash = report["episodes"][0]["state_hash"].as_str().expect("a hash");
    assert!(read("runs/a run/report.episodes.csv").lines().nth(1).expect("a row").contains(hash));

    // A report in another folder has links relative to that folder. Both stay valid when all folders are
    // moved.
    tandem(place.path(), &["report", "runs/a run", "--out", "elsewhere.html"]);
    fs::rename(place.path().join("runs"), place.path().join("moved")).expect("a renamed folder");
    let own = read("moved/a run/report.html");
    assert_eq!(local_links(&own), ["episodes/handover-2000/report.html"]);
    assert!(place.path().join("moved/a run").join(local_links(&own)[0]).exists());
    assert_eq!(local_links(&read("elsewhere.html")), ["runs/a%20run/episodes/handover-2000/report.html"]);

    compile(&place.path().join("moved/a run"), "report.tex");
}

/// Compiles a document that includes this file, if LaTeX is installed.
fn compile(folder: &Path, file: &str) {
    if Command::new("pdflatex").arg("--version").output().is_err() {
        return skipped("there is no pdflatex");
    }
    let document = format!(
        "\\documentclass{{article}}\n\\usepackage{{booktabs,graphicx,longtable}}\n\\begin{{document}}\n\
         \\input{{{file}}}\n\\end{{document}}\n"
    );
    fs::write(folder.join("document.tex"), document).expect("a document");
    let arguments = ["-interaction=nonstopmode", "-halt-on-error", "document.tex"];
    let output = Command::new("pdflatex").current_dir(folder).args(arguments).output().expect("it starts");
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && !printed.contains("Overfull"), "{printed}");
}

#[cfg(unix)]
#[test]
fn models_are_one_table_with_links_to_what_they_said() {
    if Command::new("curl").arg("--version").output().is_err() {
        return skipped("there is no curl");
    }
    let place = tempfile::tempdir().expect("a temporary folder");
    let post =
        "curl -sf -X POST -H \"Authorization: Bearer $TANDEM_TOKEN\" -H 'content-type: application/json'";
    let tools = "\"$TANDEM_URL/v1/episodes/$TANDEM_EPISODE/tools";
    let program = format!(
        "exec:{post} -d '{{\"steps\": 5}}' {tools}/wait\" > /dev/null; {post} -d '{{}}' {tools}/finish\" > /dev/null"
    );
    play(place.path(), &program, "runs/program");
    play(place.path(), "idle", "runs/idle");
    // This is the same episode in the form in which a server and `tandem agent` leave it.
    let (played, served) =
        (place.path().join("runs/program/episodes/handover-2000"), "runs/served/handover-seed2000");
    let served = place.path().join(served);
    fs::create_dir_all(&served).expect("a folder");
    for name in ["episode.mcap", "report.html"] {
        fs::copy(played.join(name), served.join(name)).expect(name);
    }
    fs::write(served.join("agent.json"), r#"{"flags": {"model": "m-1", "api": "openai", "seed": 2000}}"#)
        .expect("a file");

    let folders = ["runs/program", "runs/idle", "runs/served"];
    let printed = tandem(place.path(), &[&["leaderboard"], &folders[..], &["--out", "table"]].concat());
    assert_eq!(printed, "table/leaderboard.md\ntable/leaderboard.html\ntable/leaderboard.json\n");
    let read = |name: &str| fs::read_to_string(place.path().join("table").join(name)).expect(name);
    let board: Value = serde_json::from_str(&read("leaderboard.json")).expect("JSON");
    let row = |policy: &str| {
        let rows = board["policies"].as_array().expect("rows");
        rows.iter().find(|row| row["policy"] == policy).unwrap_or_else(|| panic!("no {policy} in {board}"))
    };
    let replies = |policy: &str| row(policy)["costs"]["reply_kilobytes"]["median_value"].as_f64();
    assert!(replies("agent:m-1") > Some(0.1) && replies("agent:m-1") == replies(&program), "{board}");
    assert_eq!((replies("idle"), row("idle")["phases"]["trials"].as_u64()), (None, Some(3)));
    assert_eq!(row("GPT-6 Astra")["source"], "CoHuB's paper");

    let page = read("leaderboard.html");
    let links = local_links(&page);
    assert_eq!(links.len(), 2, "{links:?}");
    assert!(links.contains(&"../runs/served/handover-seed2000/report.html"), "{links:?}");
    for link in links {
        assert!(place.path().join("table").join(link).exists(), "{link}");
    }
    assert!(read("leaderboard.md").contains("| agent:m-1 | benchmark | paper | handover |"));
}
