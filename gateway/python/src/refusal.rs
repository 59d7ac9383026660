//! Refusals as Python's exceptions: the class by the kind of refusal, the text what the server would have said.

use std::fmt::Display;

use pyo3::prelude::*;
use tandem::hosting::HostingError;
use tandem_tools_spec::Refusal;

/// The exception for a refusal of an episode.
pub fn refused(py: Python, error: &HostingError) -> PyErr {
    let Refusal { kind, title, hint, .. } = error.refusal();
    let detail = match hint {
        Some(hint) => format!("{error}; {hint}"),
        None => error.to_string(),
    };
    raised(py, (kind, title, detail))
}

/// The exception for anything else that cannot be done, which has no kind.
pub fn failed(py: Python, error: &dyn Display) -> PyErr {
    raised(py, ("failed", "Failed", error.to_string()))
}

/// Why nothing is done in another process than the one that made it.
pub fn forked(maker: u32) -> String {
    format!("this was made in process {maker}, of which this one is a fork; make another one here")
}

/// The package has the classes, because callers over HTTP get the same.
fn raised(py: Python, (kind, title, detail): (&str, &str, String)) -> PyErr {
    let made = py
        .import("tandem.errors")
        .and_then(|errors| errors.getattr("of_kind"))
        .and_then(|of_kind| of_kind.call1((kind, title, detail)));
    made.map_or_else(|error| error, PyErr::from_value)
}
