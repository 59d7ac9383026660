//! What can go wrong while a model is built or a problem is set up.

/// The text names what was asked for and what there is.
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
    /// Something in the file that this crate has no use for.
    #[error("{0}")]
    Unsupported(String),
    /// A frame is not in the model.
    #[error("no frame `{name}`; have: {have}")]
    UnknownFrame {
        /// The name asked for.
        name: String,
        /// Names there are, separated by commas.
        have: String,
    },
    /// A joint is not in the model.
    #[error("no joint `{name}`; have: {have}")]
    UnknownJoint {
        /// The name asked for.
        name: String,
        /// Names there are, separated by commas.
        have: String,
    },
    /// A vector of joint coordinates has the wrong length.
    #[error("{got} joint coordinates given, the model has {expected} joints")]
    WrongLength {
        /// Length of the vector given.
        got: usize,
        /// Joints of the model.
        expected: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what} is not finite")]
    NotFinite {
        /// Which number.
        what: &'static str,
    },
}
