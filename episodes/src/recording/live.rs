//! Interface for programs that show recordings while they are written.

use std::collections::BTreeMap;
use std::fmt::Debug;

use foxglove::Schema;

/// Viewer of recordings, for example a server. It is told of every recording that begins.
pub trait LiveViewer: Debug + Send + Sync {
    /// Returns the view of a recording that begins.
    fn begin(&self) -> Box<dyn LiveRecording>;
}

/// View of one recording. Calls come from the recorder's thread, in the order of the file.
pub trait LiveRecording: Send {
    /// Opens a channel.
    fn open(&mut self, channel: LiveChannel);

    /// Shows a message of a channel.
    fn send(&mut self, topic: &str, time_ns: u64, message: &[u8]);
}

/// Description of a channel of a recording, as in the file.
#[derive(Clone, Debug)]
pub struct LiveChannel {
    pub topic: String,
    pub encoding: String,
    pub schema: Option<Schema>,
    /// Names of an array's columns, for example.
    pub metadata: BTreeMap<String, String>,
    /// True if the whole channel describes the present, and not only its latest message.
    pub is_scene: bool,
}
