//! Errors in settings.

use std::{net::SocketAddr, path::PathBuf};

use tandem_episodes::{InstructionsError, RobotError, SimError, TaskFileError};
use tandem_evaluation::TaskCheckError;

use super::tls::TlsError;
use crate::token::TokenError;

/// Reason why settings cannot be resolved.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The file cannot be read.
    #[error("cannot read the settings file {path}: {source}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the system.
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
        "other machines reach {listen}; give a token that every request has to send, by --token-file FILE or \
         in TANDEM_TOKEN (`openssl rand -hex 32` makes one), or listen on 127.0.0.1"
    )]
    Open {
        /// Address to serve on.
        listen: SocketAddr,
    },
    /// A limit is zero.
    #[error("{setting} is 0, and the server could not be used; give at least 1, for example {example}")]
    Zero {
        /// Name of the setting in files.
        setting: &'static str,
        /// Example of a valid number.
        example: &'static str,
    },
    /// A stress level is given without a kind of stress.
    #[error(
        "a level says how much of what goes wrong; give stress, too, for example camera, or leave level out"
    )]
    LevelAlone,
    /// Two settings change the wording of tasks.
    #[error("the stress words tells tasks in other words, and so does instructions; give one of them")]
    TwoWordings,
    /// A live view is requested, but recordings are readable only after their episodes.
    #[error("foxglove shows recordings during episodes, and record is \"after\"; leave one of them out")]
    LiveAfter,
    /// An allowed host is not a host name.
    #[error(
        "allowed_host {name:?} is no name of a host; give it alone, for example lab.example, without http:// \
         and port"
    )]
    NoHost {
        /// Given text.
        name: String,
    },
    /// The file with instructions cannot be used.
    #[error(transparent)]
    Instructions(#[from] InstructionsError),
    /// A task's file cannot be used.
    #[error(transparent)]
    TaskFile(#[from] TaskFileError),
    /// A task of a file is valid, but cannot be played.
    #[error("{path}: {source}")]
    Task {
        /// Path of the file.
        path: PathBuf,
        /// Failure of the trial.
        source: Box<TaskCheckError>,
    },
    /// The scene, the robot, the base controller or the renderer cannot be used.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The robot has changed since it was read, or does not fit the task or the base controller.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The file is not valid TOML, or has an unknown setting.
    #[error("{path}: {source}")]
    Parse {
        /// Path of the file.
        path: PathBuf,
        /// Error with its position.
        source: toml::de::Error,
    },
}
