//! What can go wrong while a world is put together.

/// Loading failed; the text names the file and what would work.
#[derive(Debug, thiserror::Error)]
pub enum SimError {
    #[error("no {kind} `{name}`; have: {have}")]
    UnknownAsset { kind: &'static str, name: String, have: String },
    #[error("cannot read `{path}`: {source}")]
    Read { path: String, source: std::io::Error },
    #[error("`{file}` is not valid MJCF: {source}")]
    Mjcf { file: String, source: mjcf_rs::ParseError },
    #[error("`{file}` is not valid XML: {source}")]
    Xml { file: String, source: roxmltree::Error },
    #[error("`{file}`: {what}")]
    Unsupported { file: String, what: String },
    #[error("snapshot cannot be read: {0}; it must come from this binary and this world")]
    Snapshot(#[from] postcard::Error),
}
