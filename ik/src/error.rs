//! Errors of building a model or setting up a problem.

/// Error of this crate. The text names the requested item and the available ones.
#[derive(Debug, thiserror::Error)]
pub enum IkError {
    /// The MJCF text cannot be read.
    #[error("not valid MJCF: {0}")]
    Mjcf(#[from] mjcf_rs::ParseError),
    /// The URDF text cannot be read.
    #[cfg(feature = "urdf")]
    #[error("not valid URDF: {0}")]
    Urdf(#[from] urdf_rs::UrdfError),
    /// A file of targets cannot be read.
    #[error("not a valid targets file: {0}")]
    Targets(#[from] serde_json::Error),
    /// The file contains an element that this crate does not support.
    #[error("{0}")]
    Unsupported(String),
    /// A frame is not in the model.
    #[error("no frame `{name}`; have: {have}")]
    UnknownFrame {
        /// The requested name.
        name: String,
        /// Available names, separated by commas.
        have: String,
    },
    /// A joint is not in the model.
    #[error("no joint `{name}`; have: {have}")]
    UnknownJoint {
        /// The requested name.
        name: String,
        /// Available names, separated by commas.
        have: String,
    },
    /// A vector of joint coordinates has the wrong length.
    #[error("{got} joint coordinates given, the model has {expected} joints")]
    WrongLength {
        /// Length of the given vector.
        got: usize,
        /// Number of joints of the model.
        expected: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what} is not finite")]
    NotFinite {
        /// Name of the number.
        what: &'static str,
    },
}
