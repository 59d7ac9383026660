//! Sources of a robot: an embedded file, the user's own MJCF, or a description of third-party MJCF.

use std::path::Path;

use super::{RobotModel, fitted};
use crate::mjcf::Document;
use crate::{SimError, assets};

/// A robot as read from its file.
#[derive(Debug)]
pub struct RobotSource {
    pub model: RobotModel,
    /// The MJCF, in which joints, wrists and camera have their published names.
    pub document: Document,
    /// Hash that distinguishes robots of different files, including the files that these name.
    pub fingerprint: u64,
}

impl RobotSource {
    /// Reads a file: MJCF for [`RobotModel::of`], or with the extension `.toml` a description of
    /// third-party MJCF.
    ///
    /// # Errors
    ///
    /// Returns an error if a file cannot be read or does not describe a robot.
    pub fn read(path: &Path) -> Result<RobotSource, SimError> {
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
            let (model, document, fingerprint) = fitted::read(path)?;
            return Ok(RobotSource { model, document, fingerprint });
        }
        RobotSource::of(Document::read(path)?)
    }

    /// Reads an embedded robot.
    ///
    /// # Errors
    ///
    /// Returns an error if no embedded robot has this name.
    pub fn embedded(name: &str) -> Result<RobotSource, SimError> {
        RobotSource::of(Document::parse(name, assets::robot(name)?)?)
    }

    fn of(document: Document) -> Result<RobotSource, SimError> {
        Ok(RobotSource { model: RobotModel::of(&document)?, fingerprint: document.fingerprint(), document })
    }
}
