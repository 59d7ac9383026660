//! Transcripts: the calls, replies and notes of an episode in their order.

use super::read::{Recording, RecordingError};
use super::topics::messages::ToolCallMessage;
use super::topics::notes::NoteMessage;

/// A call or a note.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "most of them are calls")]
pub enum TranscriptEntry {
    /// A call. Calls that count are numbered from 1.
    Call {
        number: Option<u32>,
        /// Simulated time of the reply.
        time_s: f64,
        call: ToolCallMessage,
    },
    Note {
        time_s: f64,
        note: NoteMessage,
    },
}

impl Recording {
    /// Returns every call and every note in their order, including refused calls and those that do not
    /// count.
    ///
    /// # Errors
    ///
    /// If a message cannot be read.
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
