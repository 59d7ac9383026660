//! The native module of the Python package `tandem`: episodes in the caller's own process, recordings,
//! evaluations, and the whole command line. Python code uses the typed package around it, in
//! `gateway/python/tandem`.
//!
//! Replies are passed as the same JSON as over HTTP, and values of every step as arrays. Python's lock is
//! released during physics and rendering.

mod arrays;
mod episode;
mod evaluation;
mod players;
mod program;
mod recording;
mod refusal;
mod worlds;

/// The native part of the package `tandem`.
#[pyo3::pymodule]
mod _native {
    use std::path::PathBuf;

    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::arrays::{action_columns, setpoint_columns, state_columns};
    #[pymodule_export]
    use crate::episode::{NativeEpisode, Snapshot};
    #[pymodule_export]
    use crate::evaluation::{demonstrations_folder, evaluate};
    #[pymodule_export]
    use crate::program::{NativeServer, available_processors, list_tasks, run_command_line, write_report};
    #[pymodule_export]
    use crate::recording::NativeRecording;
    #[pymodule_export]
    use crate::worlds::{NativeWorlds, row_contract, row_contract_version, row_rates_hz, row_state_columns};

    /// Sets the path of this library, instead of the Python interpreter, as the build that creates episodes,
    /// recordings and checkpoints.
    #[pyfunction]
    fn loaded_from(path: PathBuf) {
        tandem_episodes::name_program(path);
    }
}
