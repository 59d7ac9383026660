//! The whole program: its command line, and a server in the background.

use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use clap::Parser;
use pyo3::prelude::*;
use serde_json::json;
use tandem::cli::Cli;
use tandem::hosting::try_runs_folder;
use tandem::http::Server;
use tandem::settings::{Layer, Settings};
use tandem_episodes::task_list;

use crate::refusal::failed;

/// Runs the command line with these arguments, of which the first is the program's name, and returns the exit
/// code.
#[pyfunction]
pub fn run_command_line(py: Python, arguments: Vec<String>) -> u8 {
    py.detach(|| {
        let cli = match Cli::try_parse_from(arguments) {
            Ok(cli) => cli,
            Err(asked) => {
                // If the message cannot be printed, the exit code still reports the error.
                let _ = asked.print();
                return u8::try_from(asked.exit_code()).unwrap_or(1);
            }
        };
        match cli.run() {
            Ok(code) => u8::from(code != ExitCode::SUCCESS),
            Err(error) => {
                eprintln!("tandem: {error}");
                1
            }
        }
    })
}

/// Runs a command for a function of the package. An error becomes an exception.
#[pyfunction]
pub fn write_report(py: Python, arguments: Vec<String>) -> PyResult<()> {
    let run = || -> Result<(), String> {
        let cli = Cli::try_parse_from(arguments).map_err(|error| error.to_string())?;
        cli.run().map(drop).map_err(|error| error.to_string())
    };
    py.detach(run).map_err(|text| failed(py, &text))
}

/// Returns the number of processors that this process may use. In a container, this is the quota rather than
/// the machine's number of cores.
#[pyfunction]
pub fn available_processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Returns the tasks as JSON.
#[pyfunction]
pub fn list_tasks(py: Python) -> PyResult<String> {
    let settings = Settings::resolve(Layer::default(), None).map_err(|error| failed(py, &error))?;
    Ok(json!(task_list(&settings.tasks, None, &settings.base_limits)).to_string())
}

/// A server in the background of this process.
#[pyclass(frozen, name = "Server", module = "tandem._native")]
pub struct NativeServer {
    running: Mutex<Option<Server>>,
    url: String,
}

#[pymethods]
impl NativeServer {
    /// Starts a server with these settings, which are JSON.
    #[staticmethod]
    fn start(py: Python, settings: &str) -> PyResult<NativeServer> {
        let start = || -> Result<Server, String> {
            let layer: Layer = serde_json::from_str(settings).map_err(|error| error.to_string())?;
            let settings = Settings::resolve(layer, None).map_err(|error| error.to_string())?;
            try_runs_folder(&settings.runs)?;
            Server::start(settings).map_err(|error| error.to_string())
        };
        let server = py.detach(start).map_err(|text| failed(py, &text))?;
        let url = format!("http://{}", server.address());
        Ok(NativeServer { running: Mutex::new(Some(server)), url })
    }

    /// Returns the URL of the server.
    #[getter]
    fn url(&self) -> &str {
        &self.url
    }

    /// Finishes pending calls and closes all recordings. Returns the episodes that did not end in time.
    fn stop(&self, py: Python) -> Vec<String> {
        py.detach(|| {
            let running = self.running.lock().unwrap_or_else(PoisonError::into_inner).take();
            running.map_or_else(Vec::new, Server::stop)
        })
    }
}

impl Drop for NativeServer {
    fn drop(&mut self) {
        if let Some(server) = self.running.get_mut().unwrap_or_else(PoisonError::into_inner).take() {
            server.stop();
        }
    }
}
