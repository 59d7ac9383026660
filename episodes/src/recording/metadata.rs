//! Metadata records that are read back, with their entries. Each has its checksum as an entry, because the
//! format provides none before the whole file is written. The remains of a killed process can thus be
//! distinguished from damage by a bad disk.

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

/// Returns a record with its checksum.
pub fn with_checksum(name: &str, mut metadata: BTreeMap<String, String>) -> Metadata {
    let checksum = checksum(name, &metadata);
    metadata.insert(CHECKSUM.into(), format!("{checksum:08x}"));
    Metadata { name: name.into(), metadata }
}

/// Checks a record against its checksum. Returns `false` if it has none, as in recordings of earlier
/// versions.
pub fn is_covered(record: &Metadata) -> Result<bool, Fault> {
    let Some(saved) = record.metadata.get(CHECKSUM) else { return Ok(false) };
    let calculated = checksum(&record.name, &record.metadata);
    if *saved == format!("{calculated:08x}") {
        return Ok(true);
    }
    let saved = u32::from_str_radix(saved, 16).map_err(|_| Fault::Unexpected)?;
    Err(Fault::Checksum { saved, calculated })
}

/// Returns the checksum of a record's texts, each preceded by its length, so that different records never
/// have the same bytes.
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
