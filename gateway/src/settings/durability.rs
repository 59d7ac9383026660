//! Durability of a call before it is answered.

use serde::Deserialize;

/// How far a call has to be on its way to the disk before its answer leaves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Durability {
    /// With the operating system: it outlives the process, however that ends.
    #[default]
    System,
    /// On the disk: it outlives a power cut, too.
    Disk,
}
