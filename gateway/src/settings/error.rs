//! Why settings cannot be resolved.

use std::{net::SocketAddr, path::PathBuf};

use tandem_episodes::{InstructionsError, RobotError, SimError, TaskCheckError, TaskFileError};

use super::tls::TlsError;
use crate::token::TokenError;

/// Why settings cannot be resolved.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The file cannot be read.
    #[error("cannot read the settings file {path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The token cannot be used.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A file and the environment both give a token.
    #[error("both --token-file and TANDEM_TOKEN give a token; give one of them")]
    TwoTokens,
    /// HTTPS cannot be served.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// Other machines would reach a server without a token.
    #[error(
        "other machines reach {listen}; give a token that every request has to send, by --token-file FILE or in TANDEM_TOKEN (`openssl rand -hex 32` makes one), or listen on 127.0.0.1"
    )]
    Open {
        /// The address to serve on.
        listen: SocketAddr,
    },
    /// A limit that lets nothing through.
    #[error("{setting} is 0, and the server could not be used; give at least 1, as {example}")]
    Zero {
        /// As files call it.
        setting: &'static str,
        /// A number that works.
        example: &'static str,
    },
    /// A level of nothing.
    #[error("a level says how much of what goes wrong; give stress, too, as camera, or leave level out")]
    LevelAlone,
    /// Two settings say in what words tasks are told.
    #[error("the stress words tells tasks in other words, and so does instructions; give one of them")]
    TwoWordings,
    /// What the server is to be reached by is no name.
    #[error(
        "allowed_host {name:?} is no name of a host; give it alone, as lab.example, without http:// and port"
    )]
    NoHost {
        /// What was given.
        name: String,
    },
    /// The file with instructions cannot be used.
    #[error(transparent)]
    Instructions(#[from] InstructionsError),
    /// A task's file cannot be used.
    #[error(transparent)]
    TaskFile(#[from] TaskFileError),
    /// A task of a file is well written, and cannot be played.
    #[error("{path}: {source}")]
    Task {
        /// The file.
        path: PathBuf,
        /// What happens.
        source: Box<TaskCheckError>,
    },
    /// The scene, the robot, the base controller or the renderer cannot be used.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The robot has changed since it was read.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The file is no TOML, or holds a setting that does not exist.
    #[error("{path}: {source}")]
    Parse {
        /// The file.
        path: PathBuf,
        /// Where and what.
        source: toml::de::Error,
    },
}
