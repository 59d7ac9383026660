//! A server in a separate process.

use std::{
    fs,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;
use ureq::Agent;

/// Time limit for the end of a server.
const END_TIMEOUT: Duration = Duration::from_secs(90);

/// A running process. Dropping it kills the process.
pub struct Server {
    child: Child,
    pub url: String,
    agent: Agent,
}

impl Server {
    /// Starts a server on a free port that records into `runs`.
    pub fn start(runs: &Path) -> Server {
        Server::run(Command::new(env!("CARGO_BIN_EXE_tandem")), runs)
    }

    /// Starts a server as [`Server::start`] does. `program` is a command that runs `tandem` with the
    /// arguments that follow.
    pub fn run(mut program: Command, runs: &Path) -> Server {
        let flags = ["serve", "--listen", "127.0.0.1:0", "--runs"];
        let mut child =
            program.args(flags).arg(runs).stderr(Stdio::piped()).spawn().expect("the program starts");
        let mut log = BufReader::new(child.stderr.take().expect("its log")).lines().map_while(Result::ok);
        let serving = |line: String| Some(line.split_once("http://")?.1.trim().to_owned());
        let address = log.find_map(serving).expect("the log says where it serves");
        // The log is read to its end, because a full pipe would block the program.
        thread::spawn(move || log.for_each(drop));
        let agent = Agent::config_builder().http_status_as_error(false).build().new_agent();
        Server { child, url: format!("http://{address}"), agent }
    }

    /// Returns the answer to a call, or `None` if the server has ended in the meantime.
    pub fn post(&self, path: &str, body: &Value) -> Option<Value> {
        let request = self.agent.post(format!("{}{path}", self.url));
        // MCP requires this header, and REST accepts it.
        let request = request.header("accept", "application/json, text/event-stream");
        let mut response = request.send_json(body).ok()?;
        response.body_mut().read_json().ok()
    }

    /// Calls a tool and returns the answer. Panics if there is none.
    #[track_caller]
    pub fn tool(&self, id: &str, tool: &str, args: &Value) -> Value {
        self.post(&format!("/v1/episodes/{id}/tools/{tool}"), args).expect("an answer")
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits until the process has ended.
    #[track_caller]
    pub fn ended(&mut self) -> ExitStatus {
        let deadline = Instant::now() + END_TIMEOUT;
        loop {
            if let Some(status) = self.child.try_wait().expect("the state of our own child") {
                return status;
            }
            assert!(Instant::now() < deadline, "the server does not end");
            thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns every partial file of the run folders in `runs`.
pub fn partials(runs: &Path) -> Vec<PathBuf> {
    let entries = |folder: &Path| {
        let entries = fs::read_dir(folder).into_iter().flatten();
        entries.map(|entry| entry.expect("an entry").path()).collect::<Vec<_>>()
    };
    let files = entries(runs).into_iter().flat_map(|folder| entries(&folder));
    files.filter(|path| path.extension().is_some_and(|extension| extension == "partial")).collect()
}

/// A generator of random delays that are the same in every run (Knuth's MMIX generator).
pub struct Delays(pub u64);

impl Delays {
    /// Returns a delay below `most_ms`.
    pub fn next(&mut self, most_ms: u64) -> Duration {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        Duration::from_millis((self.0 >> 33) % most_ms)
    }
}

/// Returns true if this process and its children ignore hangups, for example under `nohup`.
pub fn hangups_are_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).is_some_and(|set| set & 1 == 1)
}
