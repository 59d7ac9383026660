//! Records of metadata that are read back, their entries, and the checksum that each has among them: the format gives it none
//! before the whole file is written, and what a killed process leaves has to be told from what a bad disk has made of it.

use std::collections::BTreeMap;

use mcap::records::Metadata;

use super::damage::Fault;

pub const EPISODE: &str = "episode";
pub const SPEC: &str = "spec";
pub const LOCOMOTION: &str = "locomotion";
pub const BUILD: &str = "build";
pub const SCORES: &str = "scores";
pub const RESULT: &str = "result";

/// Entry with the CRC-32 of the record's name and other entries, as eight hexadecimal digits.
const CHECKSUM: &str = "crc32";

/// A record with its checksum.
pub fn with_checksum(name: &str, mut metadata: BTreeMap<String, String>) -> Metadata {
    let checksum = checksum(name, &metadata);
    metadata.insert(CHECKSUM.into(), format!("{checksum:08x}"));
    Metadata { name: name.into(), metadata }
}

/// Whether a checksum covers the record; recordings of earlier versions have none.
pub fn is_covered(record: &Metadata) -> Result<bool, Fault> {
    let Some(saved) = record.metadata.get(CHECKSUM) else { return Ok(false) };
    let calculated = checksum(&record.name, &record.metadata);
    if *saved == format!("{calculated:08x}") {
        return Ok(true);
    }
    let saved = u32::from_str_radix(saved, 16).map_err(|_| Fault::Unexpected)?;
    Err(Fault::Checksum { saved, calculated })
}

/// Of every text with its length before it, so that no two records are told by the same bytes.
fn checksum(name: &str, entries: &BTreeMap<String, String>) -> u32 {
    let entries = entries.iter().filter(|(key, _)| *key != CHECKSUM);
    let texts = std::iter::once(name).chain(entries.flat_map(|(key, value)| [key.as_str(), value.as_str()]));
    let mut hasher = crc32fast::Hasher::new();
    for text in texts {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    }
    hasher.finalize()
}
