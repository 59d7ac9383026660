//! How a program and its episode came to part, in the words of the result.

use std::{fs, path::Path, time::Duration};

use tandem_tools_spec::{EndReason, ResultReply};

use super::process::{STDERR_FILE, STDOUT_FILE};

const LONGEST_WORDS_CHARS: usize = 300;

/// Why a program is looked at no longer.
pub enum Leaving {
    /// It ended by itself.
    Left,
    /// Its episode is over, and it is still there.
    Stays,
    /// It took longer than this.
    OutOfTime(Duration),
}

impl Leaving {
    /// What kept a program from the end of its episode, if anything did. `status` is the program's, `over` whether the episode had
    /// ended by then, and its words are kept in `folder`.
    pub fn reason(&self, status: &str, over: bool, result: &ResultReply, folder: &Path) -> Option<String> {
        match (self, over, result.ended) {
            (Leaving::OutOfTime(limit), ..) => {
                Some(format!("the program was stopped after {} s", limit.as_secs_f64()))
            }
            (_, true, EndReason::WallClockExhausted) => Some("the policy's wall clock ran out".into()),
            (_, true, EndReason::Abandoned) => Some("the program made no call for too long".into()),
            (Leaving::Left, false, _) => {
                let calls = match result.tool_calls {
                    0 => "without a call".into(),
                    1 => "after 1 call".into(),
                    calls => format!("after {calls} calls"),
                };
                let words = last_words(folder).map(|words| format!("; its last words: {words}"));
                let words = words.unwrap_or_default();
                Some(format!("the program ended {calls}, before its episode did ({status}){words}"))
            }
            (Leaving::Left | Leaving::Stays, ..) => None,
        }
    }
}

/// The last line that a program has written, to where it complains or else to where it speaks.
fn last_words(folder: &Path) -> Option<String> {
    [STDERR_FILE, STDOUT_FILE].into_iter().find_map(|name| {
        let bytes = fs::read(folder.join(name)).ok()?;
        let text = String::from_utf8_lossy(&bytes);
        let line = text.lines().map(str::trim).rfind(|line| !line.is_empty())?;
        Some(line.chars().take(LONGEST_WORDS_CHARS).collect())
    })
}
