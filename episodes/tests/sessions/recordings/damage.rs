//! Tests of recordings with changed or missing bytes. Reading never aborts or panics, no changed recording is
//! verified, and recovered recordings can be replayed.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use tandem_episodes::replay::{Verdict, verify};
use tandem_episodes::{
    FilePart, RecordedCall, Recorder, Recording, RecordingError, RecoverError, Session, recover,
};
use tandem_tools_spec::{Finish, Observe, Protocol};

use super::interrupted;
use crate::common::*;

/// Number of flipped bytes and of cuts, over all recordings.
const FLIPS: usize = 2000;
const CUTS: usize = 200;
/// One in `RECOVERED` damaged recordings is recovered as well, and one in `SIMULATED` of these is simulated.
const RECOVERED: usize = 5;
const SIMULATED: usize = 10;

/// Pseudorandom numbers, the same in every run (xorshift64, Marsaglia 2003).
struct Chance(u64);

impl Chance {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit as u64) as usize
    }
}

/// Makes three small recordings: one with images and a result, one with three robots, and one recovered
/// without an end.
fn recordings(folder: &Path) -> [PathBuf; 3] {
    let [looks, three, cut] = ["looks", "three", "cut"].map(|name| folder.join(name));
    let mut session = Session::start(&spec("handover", 3, Protocol::Benchmark), Some(&looks)).unwrap();
    command(&mut session, raise_hand(4));
    session.call(Observe { robots: Some(vec!["A".into()]), ..Observe::of_all() }.into()).unwrap();
    wait(&mut session, 3);
    session.call(Finish {}.into()).unwrap();
    let mut session =
        Session::start(&spec("trash_collection", 3, Protocol::Benchmark), Some(&three)).unwrap();
    wait(&mut session, 6);
    session.close();
    recover(&interrupted(&cut, 2)).unwrap();
    [looks, three, cut].map(|folder| folder.join(Recorder::FILE_NAME))
}

/// Reads the state hashes and the tool calls of a recording.
fn content(recording: &Recording) -> (Vec<(u64, String)>, Vec<RecordedCall>) {
    let hashes = recording.state_hashes().map(Result::unwrap).collect();
    (hashes, recording.tool_calls().unwrap())
}

/// Checks that the content recovered from `bytes` is a prefix of `original`, or that the recovery fails.
fn recovers_a_beginning(bytes: &[u8], original: &Recording, folder: &Path, simulate: bool, what: &str) {
    let partial = folder.join("episode.mcap.partial");
    fs::write(&partial, bytes).unwrap();
    match recover(&partial) {
        Ok(recovered) => {
            let found = Recording::read(&recovered.path).unwrap();
            assert_eq!((&found.spec, &found.build), (&original.spec, &original.build), "{what}");
            let ((hashes, calls), (all_hashes, all_calls)) = (content(&found), content(original));
            assert!(all_hashes.starts_with(&hashes) && all_calls.starts_with(&calls), "{what}");
            let lacks = hashes.len() < all_hashes.len() || calls.len() < all_calls.len();
            let is_torn = !ends_behind_a_record(bytes);
            assert!(
                recovered.left_out.is_some() || !(lacks && is_torn),
                "{what}: what is missing was not said"
            );
            if simulate {
                assert_eq!(verify(&found).unwrap().outcome, Verdict::Same, "{what}");
            }
            fs::remove_file(recovered.path).unwrap();
        }
        Err(error) => {
            let known = matches!(error, RecoverError::Nothing { .. } | RecoverError::TooLittle { .. });
            assert!(known, "{what}: {error}");
            let text = error.to_string();
            assert!(!text.replace("episode.mcap.partial", "").contains("episode.mcap"), "{what}: {text}");
            assert!(!text.contains("tandem recover"), "{what}: {text}");
            assert!(!folder.join(Recorder::FILE_NAME).exists(), "{what}");
        }
    }
    assert!(fs::read(&partial).unwrap() == bytes, "{what}: what is recovered stays as it is");
}

/// Returns true if a file ends with a complete record, as after a kill. Such a file does not show that more
/// was written.
fn ends_behind_a_record(bytes: &[u8]) -> bool {
    let mut position = mcap::MAGIC.len();
    while let Some(length) = bytes.get(position + 1..).and_then(<[u8]>::first_chunk) {
        let Some(end) = usize::try_from(u64::from_le_bytes(*length))
            .ok()
            .and_then(|length| (position + 9).checked_add(length))
        else {
            return false;
        };
        position = end;
    }
    position == bytes.len()
}

/// Every byte is covered by a check, so no change is missed: there are no bytes without meaning.
#[test]
fn no_flipped_byte_is_verified() {
    let folder = tempfile::tempdir().unwrap();
    let mut chance = Chance(25);
    let (mut in_chunks, mut named) = (0, 0);
    for path in recordings(folder.path()) {
        let bytes = fs::read(&path).unwrap();
        let original = Recording::read(&path).unwrap();
        assert_eq!(original.uncovered(), [""; 0], "{}", path.display());
        let place = tempfile::tempdir().unwrap();
        let chunks = chunk_contents(&bytes);
        // The start and the end contain most kinds of bytes; a chunk is a single kind.
        let ends = (0..160).chain(bytes.len() - 160..bytes.len());
        let random = (0..FLIPS / 3 - 320).map(|_| chance.below(bytes.len())).collect::<Vec<_>>();
        for (number, flipped) in ends.chain(random).enumerate() {
            let mut changed = bytes.clone();
            changed[flipped] ^= 1 + chance.below(255) as u8;
            let what = format!("byte {flipped} of {}", path.display());
            match Recording::from_bytes(&path, changed.clone()).map(drop) {
                Err(RecordingError::Damaged { source, .. }) => {
                    assert!(source.offset <= flipped, "{what}: {source}");
                    if chunks.iter().any(|chunk| chunk.contains(&flipped)) {
                        in_chunks += 1;
                        named += usize::from(matches!(source.part, FilePart::Chunk(_)));
                    }
                }
                Err(error) => panic!("{what}: {error}"),
                Ok(()) => panic!("{what} was not missed"),
            }
            if number % RECOVERED == 0 {
                let simulate = number % (RECOVERED * SIMULATED) == 0;
                recovers_a_beginning(&changed, &original, place.path(), simulate, &what);
            }
        }
    }
    assert!(in_chunks > FLIPS / 4, "most bytes are in chunks: {in_chunks}");
    // The compressed bytes do not reveal a few of the flipped bits; the checksum of all data does.
    assert!(named * 50 > in_chunks * 49, "chunks are named: {named} of {in_chunks}");
}

/// Returns the ranges of the chunks in a recording, without opcode and length.
fn chunk_contents(bytes: &[u8]) -> Vec<Range<usize>> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    let content = |chunk: &mcap::records::ChunkIndex| {
        let (start, length) = (chunk.chunk_start_offset as usize, chunk.chunk_length as usize);
        start + 9..start + length
    };
    summary.chunk_indexes.iter().map(content).collect()
}

#[test]
fn no_cut_is_verified() {
    let folder = tempfile::tempdir().unwrap();
    let mut chance = Chance(26);
    for path in recordings(folder.path()) {
        let bytes = fs::read(&path).unwrap();
        let original = Recording::read(&path).unwrap();
        let place = tempfile::tempdir().unwrap();
        // A cut within the magic bytes leaves no recognisable MCAP file, so recovery fails.
        let in_the_mark = 0..mcap::MAGIC.len();
        let random = (0..CUTS / 3 + 1).map(|_| chance.below(bytes.len())).collect::<Vec<_>>();
        for (number, left) in in_the_mark.clone().chain(random).enumerate() {
            let what = format!("the first {left} bytes of {}", path.display());
            let text =
                Recording::from_bytes(&path, bytes[..left].to_vec()).map(drop).unwrap_err().to_string();
            let advice = if in_the_mark.contains(&left) { "it is no MCAP file" } else { "tandem recover" };
            assert!(text.contains("at byte") && text.contains(advice), "{what}: {text}");
            recovers_a_beginning(&bytes[..left], &original, place.path(), number % SIMULATED == 0, &what);
        }
        let more = [&bytes[..], b"more"].concat();
        let text = Recording::from_bytes(&path, more).map(drop).unwrap_err().to_string();
        assert!(text.contains("the mark of MCAP files at byte"), "{text}");
    }
}

/// A declared size beyond the file's is refused, whatever its checksum.
#[test]
fn a_chunk_that_says_it_is_huge_is_refused_before_it_is_decompressed() {
    let folder = tempfile::tempdir().unwrap();
    let [path, ..] = recordings(folder.path());
    let bytes = fs::read(&path).unwrap();
    let opcode = 6;
    let size = bytes.windows(4).position(|window| window == b"zstd").unwrap() - 4 - 4 - 8;
    let chunk = size - 8 - 8 - 9;
    assert_eq!(bytes[chunk], opcode);
    for (field, says) in [(size, "more than they can"), (chunk + 1, "the file ends within it")] {
        let mut changed = bytes.clone();
        changed[field + 6] = 0x5f;
        let text = Recording::from_bytes(&path, changed).map(drop).unwrap_err().to_string();
        assert!(text.contains(&format!("chunk 1 at byte {chunk}: ")) && text.contains(says), "{text}");
    }
}

/// Recordings of other programs may have no checksums. They are replayed, and the unchecked parts are listed.
#[test]
fn a_recording_without_checksums_is_replayed_and_says_what_is_not_covered() {
    let folder = tempfile::tempdir().unwrap();
    let [path, ..] = recordings(folder.path());
    let bytes = fs::read(&path).unwrap();
    let copy = folder.path().join("copy.mcap");
    let options = mcap::WriteOptions::new()
        .calculate_chunk_crcs(false)
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false)
        .calculate_attachment_crcs(false);
    let mut writer = options.create(fs::File::create(&copy).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        writer.write(&message.unwrap()).unwrap();
    }
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    for index in &summary.metadata_indexes {
        let mut record = mcap::read::metadata(&bytes, index).unwrap();
        assert!(record.metadata.remove("crc32").is_some());
        writer.write_metadata(&record).unwrap();
    }
    for index in &summary.attachment_indexes {
        writer.attach(&mcap::read::attachment(&bytes, index).unwrap()).unwrap();
    }
    writer.finish().unwrap();
    let recording = Recording::read(&copy).unwrap();
    let uncovered = recording.uncovered().join(", ");
    assert_eq!(
        uncovered,
        "header and message indexes, 1 chunks, 1 attachments, 2 metadata records, the summary"
    );
    assert_eq!(verify(&recording).unwrap().outcome, Verdict::Same);

    // Nothing detects changes here, so the reading code after the checksums meets arbitrary bytes.
    let bytes = fs::read(&copy).unwrap();
    let mut chance = Chance(27);
    let mut read = 0;
    for _ in 0..FLIPS / 4 {
        let mut changed = bytes.clone();
        let flipped = chance.below(bytes.len());
        changed[flipped] ^= 1 + chance.below(255) as u8;
        let Ok(recording) = Recording::from_bytes(&copy, changed) else { continue };
        read += 1;
        let _ = (recording.tool_calls(), recording.phases());
        recording.steps().for_each(drop);
    }
    assert!(read > FLIPS / 8, "most changes are within contents: {read}");
}

/// A kill leaves the state that the file has at some moment.
#[test]
fn a_process_that_is_killed_loses_at_most_25_steps() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = Session::start(&spec("handover", 3, Protocol::Benchmark), Some(folder.path())).unwrap();
    let copies = tempfile::tempdir().unwrap();
    let mut made = 0;
    for (number, steps) in [25, 25, 7, 1, 25, 24, 25, 25, 3, 25].into_iter().enumerate() {
        made += wait(&mut session, steps).executed_steps;
        let partial = copies.path().join(format!("{number}.mcap.partial"));
        fs::copy(folder.path().join("episode.mcap.partial"), &partial).unwrap();
        let recovered = recover(&partial).unwrap();
        let kept = Recording::read(&recovered.path).unwrap().state_hashes().count() as u32 - 1;
        assert!(kept + 25 >= made, "{kept} of {made} steps are kept");
    }
}
