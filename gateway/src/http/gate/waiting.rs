//! Idle connections: their time limits, and their number per address.
//!
//! A language model may think for minutes between two calls. So a connection that has made a good call may
//! stay idle for an hour. All other connections have the time limit of a header.

use std::{
    collections::HashMap,
    io,
    net::IpAddr,
    pin::Pin,
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    task::{Context, Poll},
    time::{Duration, Instant},
};

use hyper::rt::{Sleep, Timer};
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    sync::Notify,
    time,
};

/// Maximum wait for the next request on a connection that has made a good call.
pub const MAX_TRUSTED_WAIT: Duration = Duration::from_secs(60 * 60);

/// Marker on the answer to a call of an identified caller that was not refused.
#[derive(Debug, Clone, Copy)]
pub struct GoodCall;

/// Idle connections by address, the longest wait first.
#[derive(Debug)]
pub struct WaitingConnections {
    max_per_address: usize,
    entered: AtomicU64,
    waiting: Mutex<HashMap<IpAddr, Vec<WaitingEntry>>>,
}

#[derive(Debug)]
struct WaitingEntry {
    number: u64,
    is_trusted: bool,
    crowding: Arc<Crowding>,
}

/// Signal to a connection that it must close.
#[derive(Debug, Default)]
struct Crowding {
    is_out: AtomicBool,
    told: Notify,
}

impl WaitingConnections {
    /// Creates an empty table; at most `max_per_address` connections of one address may wait.
    pub fn new(max_per_address: usize) -> WaitingConnections {
        WaitingConnections {
            max_per_address: max_per_address.max(1),
            entered: AtomicU64::new(0),
            waiting: Mutex::default(),
        }
    }

    /// Registers a new connection from `address`, which waits for its first request.
    pub fn enter(self: &Arc<Self>, address: IpAddr, header_limit: Duration) -> Arc<Connection> {
        let connection = Connection {
            all: self.clone(),
            address,
            number: self.entered.fetch_add(1, Ordering::Relaxed),
            is_trusted: AtomicBool::new(false),
            header_limit,
            wait: Mutex::new(RequestWait { since: Instant::now(), header_since: None }),
            crowding: Arc::default(),
        };
        connection.wait();
        Arc::new(connection)
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<IpAddr, Vec<WaitingEntry>>> {
        // Nothing panics while it holds the lock.
        self.waiting.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn remove(&self, connection: &Connection) {
        let mut waiting = self.lock();
        if let Some(entries) = waiting.get_mut(&connection.address) {
            entries.retain(|entry| entry.number != connection.number);
            if entries.is_empty() {
                waiting.remove(&connection.address);
            }
        }
    }

    /// Adds a connection, unless it has to close. A connection that already waits keeps its position. If too
    /// many connections of its address wait, the one with the longest wait is closed, preferably one without
    /// a good call.
    fn add(&self, connection: &Connection) {
        let mut waiting = self.lock();
        if connection.crowding.is_out.load(Ordering::Relaxed) {
            return;
        }
        let entries = waiting.entry(connection.address).or_default();
        if let Some(entry) = entries.iter_mut().find(|entry| entry.number == connection.number) {
            entry.is_trusted = connection.is_trusted();
            return;
        }
        if entries.len() >= self.max_per_address {
            let longest = entries.iter().position(|entry| !entry.is_trusted).unwrap_or(0);
            let crowding = entries.remove(longest).crowding;
            crowding.is_out.store(true, Ordering::Relaxed);
            crowding.told.notify_one();
        }
        let (number, crowding) = (connection.number, connection.crowding.clone());
        entries.push(WaitingEntry { number, is_trusted: connection.is_trusted(), crowding });
    }
}

/// A connection with the state of its wait.
#[derive(Debug)]
pub struct Connection {
    all: Arc<WaitingConnections>,
    address: IpAddr,
    number: u64,
    is_trusted: AtomicBool,
    header_limit: Duration,
    wait: Mutex<RequestWait>,
    crowding: Arc<Crowding>,
}

/// Times of the current wait for a request.
#[derive(Debug, Clone, Copy)]
struct RequestWait {
    since: Instant,
    /// Time at which the first byte of the header was received.
    header_since: Option<Instant>,
}

impl Connection {
    /// Returns the remote address.
    pub fn address(&self) -> IpAddr {
        self.address
    }

    /// Returns once this connection has to close because too many connections of its address wait.
    pub async fn crowded_out(&self) {
        self.crowding.told.notified().await;
    }

    /// Counts the connection as busy, because its request was received and admitted.
    pub fn is_served(&self) {
        self.all.remove(self);
    }

    /// Allows long waits between requests from now on.
    pub fn trust(&self) {
        self.is_trusted.store(true, Ordering::Relaxed);
    }

    fn is_trusted(&self) -> bool {
        self.is_trusted.load(Ordering::Relaxed)
    }

    /// Begins the wait for the next request.
    fn wait(&self) {
        *self.lock() = RequestWait { since: Instant::now(), header_since: None };
        self.all.add(self);
    }

    /// Records that bytes have arrived.
    fn receive(&self) {
        self.lock().header_since.get_or_insert_with(Instant::now);
    }

    /// Returns the time at which the wait ends. For a connection without a good call, the header time limit
    /// covers both the wait and the header.
    fn deadline(&self) -> Instant {
        let RequestWait { since, header_since } = *self.lock();
        match (self.is_trusted(), header_since) {
            (false, _) => since + self.header_limit,
            (true, None) => since + MAX_TRUSTED_WAIT.max(self.header_limit),
            (true, Some(begun)) => begun + self.header_limit,
        }
    }

    fn lock(&self) -> MutexGuard<'_, RequestWait> {
        // Nothing panics while it holds the lock.
        self.wait.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.all.remove(self);
    }
}

/// hyper's timer for headers, replaced by one that respects the connection's history. It starts when the
/// wait for a request begins.
#[derive(Debug, Clone)]
pub struct WaitTimer(pub Arc<Connection>);

impl Timer for WaitTimer {
    fn sleep(&self, duration: Duration) -> Pin<Box<dyn Sleep>> {
        self.sleep_until(Instant::now() + duration)
    }

    fn sleep_until(&self, _: Instant) -> Pin<Box<dyn Sleep>> {
        self.0.wait();
        let sleep = Box::pin(time::sleep_until(self.0.deadline().into()));
        Box::pin(WaitSleep { connection: self.0.clone(), sleep })
    }
}

/// A future that ends when the connection has waited for too long.
struct WaitSleep {
    connection: Arc<Connection>,
    sleep: Pin<Box<time::Sleep>>,
}

impl Future for WaitSleep {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        let deadline = self.connection.deadline().into();
        if self.sleep.deadline() != deadline {
            self.sleep.as_mut().reset(deadline);
        }
        self.sleep.as_mut().poll(context)
    }
}

impl Sleep for WaitSleep {}

/// A stream that records on its connection when bytes arrive.
pub struct NotedStream<S> {
    pub connection: Arc<Connection>,
    pub stream: S,
}

impl<S: AsyncRead + Unpin> AsyncRead for NotedStream<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let read = Pin::new(&mut self.stream).poll_read(context, buffer);
        if buffer.filled().len() > before {
            self.connection.receive();
        }
        read
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for NotedStream<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffers: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write_vectored(context, buffers)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    const HEADER_LIMIT: Duration = Duration::from_secs(30);

    fn enter(all: &Arc<WaitingConnections>, address: u32) -> Arc<Connection> {
        all.enter(Ipv4Addr::from_bits(address).into(), HEADER_LIMIT)
    }

    async fn is_closed(connection: &Connection) -> bool {
        tokio::select! {
            biased;
            () = connection.crowded_out() => true,
            () = std::future::ready(()) => false,
        }
    }

    #[test]
    fn a_good_call_lets_a_connection_live_for_an_hour() {
        let connection = enter(&Arc::new(WaitingConnections::new(4)), 1);
        let since = connection.lock().since;
        assert_eq!(connection.deadline(), since + HEADER_LIMIT);
        connection.receive();
        assert_eq!(connection.deadline(), since + HEADER_LIMIT, "a header in pieces wins no time");
        connection.trust();
        connection.wait();
        let since = connection.lock().since;
        assert_eq!(connection.deadline(), since + MAX_TRUSTED_WAIT);
        connection.receive();
        let begun = connection.lock().header_since.unwrap();
        assert_eq!(connection.deadline(), begun + HEADER_LIMIT, "a header that has begun has to end");
    }

    #[tokio::test]
    async fn the_longest_wait_makes_room_and_good_calls_come_last() {
        let all = Arc::new(WaitingConnections::new(2));
        let trusted = enter(&all, 1);
        trusted.trust();
        trusted.wait();
        let (first, other) = (enter(&all, 1), enter(&all, 2));
        let second = enter(&all, 1);
        first.wait();
        assert!(is_closed(&first).await, "it has made no good call");
        assert!(!is_closed(&trusted).await && !is_closed(&other).await && !is_closed(&second).await);
        second.is_served();
        let third = enter(&all, 1);
        assert!(!is_closed(&trusted).await && !is_closed(&second).await, "who is served does not wait");
        third.wait();
        let fourth = enter(&all, 1);
        assert!(is_closed(&third).await && !is_closed(&trusted).await, "who waits keeps its place");
        drop((third, fourth));
        assert_eq!(all.lock().len(), 2);
        drop((trusted, first, second, other));
        assert!(all.lock().is_empty());
    }
}
