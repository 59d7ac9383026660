//! Fuzzes recordings: they are read to the end or refused, and never use more memory than the file can
//! hold. Checksums of 0 count as absent, so the code after them is reached, too.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use tandem_episodes::Recording;

fuzz_target!(|bytes: &[u8]| {
    let Ok(recording) = Recording::from_bytes(Path::new("episode.mcap"), bytes.to_vec()) else { return };
    let _ = recording.tool_calls();
    let _ = recording.phases();
    recording.steps().for_each(drop);
    recording.state_hashes().for_each(drop);
});
