//! Fuzzes recordings. Each is read to the end or refused, and reading never uses more memory than the file
//! can hold. Checksums of 0 count as absent, so the fuzzer also reaches the code after the checksum tests.
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
