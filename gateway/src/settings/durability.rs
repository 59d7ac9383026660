//! Durability of a call before it is answered.

use serde::Deserialize;

/// Durability that a call needs before its answer is sent.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Durability {
    /// In the operating system: survives any end of the process.
    #[default]
    System,
    /// On the disk: also survives a power cut.
    Disk,
}
