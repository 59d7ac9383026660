//! Live view in Foxglove: a WebSocket server with the channels of the recording that began last.

use std::net::Ipv4Addr;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak};
use std::{fmt, io, mem};

use foxglove::websocket::{Capability, ChannelView, Client, ServerListener};
use foxglove::{
    ChannelBuilder, Context, PartialMetadata, RawChannel, WebSocketServer, WebSocketServerHandle,
};
use tandem_episodes::{LiveChannel, LiveRecording, LiveViewer};

/// Maximum number of messages queued for a slow client, after which the oldest are dropped. It covers about
/// 40 s of an episode, because a long command sends its messages in one burst.
const MAX_WAITING_MESSAGES: usize = 16_384;

/// Schema of shapes. A client needs all messages of this schema, not only the latest, to draw the current
/// scene.
const SCENE_SCHEMA: &str = "foxglove.SceneUpdate";

/// Server that streams the recording that began last to Foxglove clients. Clones share the server.
#[derive(Clone)]
pub struct FoxgloveServer(Arc<Shared>);

struct Shared {
    port: u16,
    context: Arc<Context>,
    server: OnceLock<WebSocketServerHandle>,
    shown: Mutex<Shown>,
}

/// The recording that is shown.
#[derive(Default)]
struct Shown {
    /// Number of the recording, counted from 1.
    number: u64,
    time_ns: u64,
    channels: Vec<ShownChannel>,
}

struct ShownChannel {
    channel: Arc<RawChannel>,
    is_scene: bool,
    /// Messages for clients that subscribe later, with log times in nanoseconds: all messages of a scene
    /// channel, and the latest message of any other channel. Physics is often paused, so no new message may
    /// follow.
    kept: Vec<(u64, Vec<u8>)>,
}

/// A recording that is shown until the next one begins.
struct ShownRecording {
    server: FoxgloveServer,
    number: u64,
}

impl fmt::Debug for FoxgloveServer {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("FoxgloveServer").finish_non_exhaustive()
    }
}

impl FoxgloveServer {
    /// Creates a server for a port of the loopback interface, because clients need no token. Port 0 picks a
    /// free one.
    pub fn on(port: u16) -> FoxgloveServer {
        let (server, shown) = (OnceLock::new(), Mutex::default());
        FoxgloveServer(Arc::new(Shared { port, context: Context::new(), server, shown }))
    }

    /// Begins to serve clients on the current Tokio runtime, and logs the URL to open in Foxglove.
    ///
    /// # Errors
    ///
    /// Returns an error if the port cannot be used.
    pub async fn serve(&self) -> io::Result<()> {
        let port = self.0.port;
        let served = WebSocketServer::new()
            .name("tandem")
            .context(&self.0.context)
            .capabilities([Capability::Time])
            .listener(Arc::new(Latecomers(Arc::downgrade(&self.0))))
            .message_backlog_size(MAX_WAITING_MESSAGES)
            .bind(Ipv4Addr::LOCALHOST.to_string(), port)
            .start();
        let server = served.await.map_err(|error| {
            io::Error::other(format!("cannot serve Foxglove on port {port}: {error}; try --foxglove 0"))
        })?;
        tracing::info!("Foxglove shows episodes from ws://{}:{}", Ipv4Addr::LOCALHOST, server.port());
        // `serve` is called once per process, so no server is set yet.
        let _ = self.0.server.set(server);
        Ok(())
    }

    fn shown(&self) -> MutexGuard<'_, Shown> {
        self.0.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LiveViewer for FoxgloveServer {
    /// Shows a new recording in place of the previous one.
    fn begin(&self) -> Box<dyn LiveRecording> {
        let (number, before) = {
            let mut shown = self.shown();
            let number = shown.number + 1;
            (number, mem::replace(&mut *shown, Shown { number, ..Shown::default() }))
        };
        // The lock is released first: closing a channel calls its clients, which may be requesting messages.
        before.channels.iter().for_each(|shown| shown.channel.close());
        if let Some(server) = self.0.server.get() {
            server.clear_session(None);
        }
        Box::new(ShownRecording { server: self.clone(), number })
    }
}

impl LiveRecording for ShownRecording {
    fn open(&mut self, LiveChannel { topic, encoding, schema, metadata }: LiveChannel) {
        let is_scene = schema.as_ref().is_some_and(|schema| schema.name == SCENE_SCHEMA);
        let channel = ChannelBuilder::new(topic)
            .context(&self.server.0.context)
            .message_encoding(encoding)
            .schema(schema)
            .metadata(metadata)
            .build_raw()
            .expect("the only error is a missing encoding");
        let mut shown = self.server.shown();
        if shown.number == self.number {
            shown.channels.push(ShownChannel { channel, is_scene, kept: Vec::new() });
        } else {
            drop(shown);
            channel.close();
        }
    }

    fn send(&mut self, topic: &str, time_ns: u64, message: &[u8]) {
        let mut guard = self.server.shown();
        let shown = &mut *guard;
        if shown.number != self.number {
            return;
        }
        let Some(of) = shown.channels.iter_mut().find(|shown| shown.channel.topic() == topic) else { return };
        if !of.is_scene {
            of.kept.clear();
        }
        of.kept.push((time_ns, message.to_vec()));
        of.channel.log_with_meta(message, PartialMetadata::with_log_time(time_ns));
        if time_ns > shown.time_ns {
            shown.time_ns = time_ns;
            if let Some(server) = self.server.0.server.get() {
                server.broadcast_time(time_ns);
            }
        }
    }
}

/// Sends the stored messages of a channel to clients that subscribe to it.
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
