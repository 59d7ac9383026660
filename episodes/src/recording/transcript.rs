//! What was asked, answered and said in an episode, one after the other.

use super::read::{Recording, RecordingError};
use super::topics::messages::ToolCallMessage;
use super::topics::notes::NoteMessage;

/// One thing that was asked or said.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "most of them are calls")]
pub enum TranscriptEntry {
    /// A call. Those that count are numbered from 1.
    Call {
        number: Option<u32>,
        /// When it was answered.
        time_s: f64,
        call: ToolCallMessage,
    },
    Note {
        time_s: f64,
        note: NoteMessage,
    },
}

impl Recording {
    /// Every call, refused ones and those that do not count included, and every note, in the order in which they came.
    pub fn transcript(&self) -> Result<Vec<TranscriptEntry>, RecordingError> {
        let mut notes = self.notes()?.into_iter().peekable();
        let (mut entries, mut count) = (Vec::new(), 0);
        for (index, call) in self.call_messages().enumerate() {
            let (time_s, call) = call?;
            while let Some((time_s, note)) = notes.next_if(|(_, note)| note.calls_before as usize <= index) {
                entries.push(TranscriptEntry::Note { time_s, note });
            }
            count += u32::from(call.counted);
            entries.push(TranscriptEntry::Call { number: call.counted.then_some(count), time_s, call });
        }
        entries.extend(notes.map(|(time_s, note)| TranscriptEntry::Note { time_s, note }));
        Ok(entries)
    }
}
