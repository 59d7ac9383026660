//! Refusals as Python exceptions. The kind of refusal determines the class, and the text is the same as the
//! server's.

use std::fmt::Display;

use pyo3::prelude::*;
use tandem::hosting::HostingError;
use tandem_tools_spec::Refusal;

/// Returns the exception for a refusal of an episode.
pub fn refused(py: Python, error: &HostingError) -> PyErr {
    let Refusal { kind, title, hint, .. } = error.refusal();
    let detail = match hint {
        Some(hint) => format!("{error}; {hint}"),
        None => error.to_string(),
    };
    raised(py, (kind, title, detail))
}

/// Returns the exception for any other failure, which has no kind.
pub fn failed(py: Python, error: &dyn Display) -> PyErr {
    raised(py, ("failed", "Failed", error.to_string()))
}

/// Returns the error message for use of an object in a forked process.
pub fn forked(maker: u32) -> String {
    format!("this was made in process {maker}, of which this one is a fork; make another one here")
}

/// Creates the exception. The package defines its class, because callers over HTTP get the same classes.
fn raised(py: Python, (kind, title, detail): (&str, &str, String)) -> PyErr {
    let made = py
        .import("tandem.errors")
        .and_then(|errors| errors.getattr("of_kind"))
        .and_then(|of_kind| of_kind.call1((kind, title, detail)));
    made.map_or_else(|error| error, PyErr::from_value)
}
