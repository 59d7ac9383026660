//! Live view of recordings in Foxglove: a WebSocket server with the channels of the recording that began
//! last.

use std::collections::BTreeMap;
use std::fmt;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak};

use foxglove::websocket::{Capability, ChannelView, Client, ServerListener};
use foxglove::{ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema};
use foxglove::{WebSocketServer, WebSocketServerHandle};

use super::topics;

/// Messages that wait for a slow client before the oldest are dropped: about 40 s of an episode, which a
/// long command plays at once.
const MAX_WAITING_MESSAGES: usize = 16_384;

/// Channels of the recording that began last, served to clients of Foxglove. Clones share them.
#[derive(Clone)]
pub struct LiveChannels(Arc<Shared>);

struct Shared {
    context: Arc<Context>,
    server: OnceLock<WebSocketServerHandle>,
    shown: Mutex<Shown>,
}

/// The recording that is shown.
#[derive(Default)]
struct Shown {
    /// Number of the recording; every recording that begins gets the next one.
    number: u64,
    time_ns: u64,
    channels: Vec<ShownChannel>,
}

struct ShownChannel {
    channel: Arc<RawChannel>,
    /// Messages for clients that subscribe later, with their times: all of the scene, and the latest of
    /// every other channel, because physics is often paused.
    kept: Vec<(u64, Vec<u8>)>,
}

/// One recording in [`LiveChannels`], until the next one begins.
pub struct LiveRecording {
    channels: LiveChannels,
    number: u64,
}

impl Default for LiveChannels {
    fn default() -> LiveChannels {
        LiveChannels(Arc::new(Shared {
            context: Context::new(),
            server: OnceLock::new(),
            shown: Mutex::default(),
        }))
    }
}

impl fmt::Debug for LiveChannels {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("LiveChannels").finish_non_exhaustive()
    }
}

impl LiveChannels {
    /// Serves the channels on a port of this machine alone, since clients need no token; port 0 picks a
    /// free one. Returns the address. Needs a Tokio runtime, on which the clients are served.
    ///
    /// # Errors
    ///
    /// Returns an error if the port cannot be used, or if the channels are served already.
    pub async fn serve(&self, port: u16) -> Result<SocketAddr, FoxgloveError> {
        let server = WebSocketServer::new()
            .name("tandem")
            .context(&self.0.context)
            .capabilities([Capability::Time])
            .listener(Arc::new(Latecomers(Arc::downgrade(&self.0))))
            .message_backlog_size(MAX_WAITING_MESSAGES)
            .bind(Ipv4Addr::LOCALHOST.to_string(), port)
            .start()
            .await?;
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, server.port()));
        match self.0.server.set(server) {
            Ok(()) => Ok(address),
            Err(second) => {
                drop(second.stop());
                Err(FoxgloveError::ServerAlreadyStarted)
            }
        }
    }

    /// Shows a new recording in place of the one before.
    pub(super) fn begin(&self) -> LiveRecording {
        let (number, before) = {
            let mut shown = self.shown();
            let number = shown.number + 1;
            (number, std::mem::replace(&mut *shown, Shown { number, ..Shown::default() }))
        };
        // A channel that closes calls its clients, who may be asking for messages at the same time.
        before.channels.iter().for_each(|shown| shown.channel.close());
        if let Some(server) = self.0.server.get() {
            server.clear_session(None);
        }
        LiveRecording { channels: self.clone(), number }
    }

    fn shown(&self) -> MutexGuard<'_, Shown> {
        self.0.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LiveRecording {
    /// Opens a channel, unless another recording has begun.
    pub fn open(
        &self,
        topic: &str,
        encoding: &str,
        schema: Option<Schema>,
        metadata: BTreeMap<String, String>,
    ) {
        let channel = ChannelBuilder::new(topic)
            .context(&self.channels.0.context)
            .message_encoding(encoding)
            .schema(schema)
            .metadata(metadata)
            .build_raw()
            .expect("the only error is a missing encoding");
        let mut shown = self.channels.shown();
        if shown.number == self.number {
            shown.channels.push(ShownChannel { channel, kept: Vec::new() });
        } else {
            drop(shown);
            channel.close();
        }
    }

    /// Sends a message on the channel `topic`, unless another recording has begun.
    pub fn send(&self, topic: &str, time_ns: u64, message: &[u8]) {
        let mut guard = self.channels.shown();
        let shown = &mut *guard;
        if shown.number != self.number {
            return;
        }
        let Some(of) = shown.channels.iter_mut().find(|shown| shown.channel.topic() == topic) else { return };
        if topic != topics::SCENE {
            of.kept.clear();
        }
        of.kept.push((time_ns, message.to_vec()));
        of.channel.log_with_meta(message, PartialMetadata::with_log_time(time_ns));
        if time_ns > shown.time_ns {
            shown.time_ns = time_ns;
            if let Some(server) = self.channels.0.server.get() {
                server.broadcast_time(time_ns);
            }
        }
    }
}

/// Sends what is kept of a channel to clients that subscribe to it.
struct Latecomers(Weak<Shared>);

impl ServerListener for Latecomers {
    fn on_subscribe(&self, client: Client, channel: ChannelView) {
        let Some(shared) = self.0.upgrade() else { return };
        let shown = shared.shown.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(of) = shown.channels.iter().find(|shown| shown.channel.id() == channel.id()) else { return };
        for (time_ns, message) in &of.kept {
            let time = PartialMetadata::with_log_time(*time_ns);
            of.channel.log_with_meta_to_sink(message, time, client.sink_id());
        }
    }
}
