//! The server: it binds, serves, and closes every recording before it stops.

use std::{io, net::SocketAddr, sync::Arc, time::Duration};

use tandem_episodes::{EpisodeSpec, RunFolder};
use tandem_tools_spec::{Driving, StartReply};
use tokio::{net::TcpListener, runtime::Runtime, sync::oneshot, task::JoinHandle, time::interval};

use super::{
    app::AppState,
    gate::{
        Gate,
        connections::{self, ConnectionLimits},
        limits::Limits,
    },
    pages::{WATCH, operate::OPERATE},
    router::router,
    watching::WatchKey,
};
use crate::{
    hosting::{EpisodeTable, EpisodeThread, Guests, HostingError, LiveFolder},
    settings::Settings,
};

/// Number of threads for requests. They only parse, wait and answer, because the simulations have separate
/// threads.
const HTTP_THREADS: usize = 2;

/// Minimum number of connections of one address that may wait for a request, even if the limit on requests is
/// lower.
const MIN_WAITING_PER_ADDRESS: usize = 64;

/// Maximum time at shutdown to wait for requests that are still being received.
const REQUEST_GRACE: Duration = Duration::from_secs(5);

/// Interval between two searches for abandoned episodes.
const TIDY_INTERVAL: Duration = Duration::from_secs(1);

/// Number of these intervals between checks of the other servers on the same runs folder.
const TICKS_PER_LOOK: u64 = 10;

/// A running server. Dropping it stops it at once; [`Server::stop`] lets pending calls finish.
#[derive(Debug)]
pub struct Server {
    runtime: Runtime,
    address: SocketAddr,
    watch_link: String,
    table: Arc<EpisodeTable>,
    stop: oneshot::Sender<()>,
    served: JoinHandle<()>,
    settings: Arc<Settings>,
}

impl Server {
    /// Binds and begins to serve.
    pub fn start(settings: Arc<Settings>) -> io::Result<Server> {
        Server::start_for(settings, Guests::default())
    }

    /// Does the same as [`Server::start`], with the purpose and the policy in `guests`.
    pub fn start_for(settings: Arc<Settings>, guests: Guests) -> io::Result<Server> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(HTTP_THREADS)
            .thread_name("http")
            .enable_all()
            .build()?;
        let listener = runtime.block_on(TcpListener::bind(settings.listen)).map_err(|error| {
            io::Error::new(
                error.kind(),
                format!("cannot listen on {}: {error}; try --listen 127.0.0.1:0", settings.listen),
            )
        })?;
        let address = listener.local_addr()?;
        if let Some(server) = &settings.foxglove {
            runtime.block_on(server.serve())?;
        }
        let table = Arc::new(EpisodeTable::for_guests(settings.clone(), guests));
        let watch_key = WatchKey::random().map_err(io::Error::other)?;
        let scheme = if settings.certificate.is_some() { "https" } else { "http" };
        let watch_link = format!("{scheme}://{address}{WATCH}#{}", watch_key.text());
        if table.serves_clients() {
            let url = settings.advertised_url.clone().unwrap_or_else(|| format!("{scheme}://{address}"));
            let url = url.trim_end_matches('/').to_owned();
            table.keep_journals(LiveFolder::beside(&settings.runs, url, settings.durability));
        }
        let app = AppState::new(table.clone(), settings.clone(), watch_key);
        let router = router(app, Gate::new(settings.clone(), address.ip()), Limits::new(&settings));
        let (stop, stopped) = oneshot::channel::<()>();
        let certificate = settings.certificate.clone();
        let stopped = async {
            let _ = stopped.await;
        };
        let served = runtime.spawn(connections::serve(
            listener,
            certificate,
            router,
            ConnectionLimits {
                header: settings.request_timeout,
                max_waiting_per_address: settings.max_requests.max(MIN_WAITING_PER_ADDRESS),
            },
            stopped,
        ));
        runtime.spawn(look_after(table.clone()));
        tracing::info!("{}", settings.assistance.about(settings.disclosure, settings.hints));
        tracing::info!("serving on {scheme}://{address}");
        Ok(Server { runtime, address, watch_link, table, stop, served, settings })
    }

    /// Returns the address of the server.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the watch link. It grants a full view of all episodes, so it must not be logged or given to
    /// policies.
    pub fn watch_link(&self) -> &str {
        &self.watch_link
    }

    /// Returns the link of the page on which people start episodes and drive robots.
    pub fn operate_link(&self) -> String {
        format!("{}{OPERATE}", self.origin())
    }

    /// Returns the link of the start page.
    pub fn start_link(&self) -> String {
        format!("{}/", self.origin())
    }

    fn origin(&self) -> &str {
        self.watch_link.split_once(WATCH).map_or(&self.watch_link, |(origin, _)| origin)
    }

    /// Starts `spec` under the name `id` with its files in `folder`, for an evaluation in this process.
    pub fn host(
        &self,
        id: &str,
        spec: EpisodeSpec,
        driving: &Driving,
        folder: RunFolder,
    ) -> Result<(Arc<EpisodeThread>, StartReply), HostingError> {
        let start = self.runtime.block_on(self.table.host(id, spec, driving, folder))?;
        Ok((self.table.get(id)?, start))
    }

    /// Ends the episode `id` and removes it.
    pub fn remove(&self, id: &str) -> Result<(), HostingError> {
        self.runtime.block_on(self.table.remove(id)).map(drop)
    }

    /// Returns the table of episodes, for experts and scoring in this process.
    pub fn table(&self) -> &Arc<EpisodeTable> {
        &self.table
    }

    /// Serves until a shutdown signal, then stops as [`Server::stop`] does.
    ///
    /// Running episodes continue when the next server on the same runs folder restores them, unless the
    /// signal came from the keyboard.
    pub fn run_until_signal(self) -> Vec<String> {
        let keep = self.runtime.block_on(shutdown_signal()) == ShutdownSignal::Terminate;
        tracing::info!("shutting down; calls under way finish first, a second signal ends at once");
        self.runtime.spawn(async {
            shutdown_signal().await;
            std::process::exit(1);
        });
        self.stop_for(keep)
    }

    /// Stops accepting requests, finishes pending calls and closes every recording. Returns after at most the
    /// time that the settings allow. Episodes that were not closed by then are logged and returned.
    pub fn stop(self) -> Vec<String> {
        self.stop_for(false)
    }

    /// Does the same as [`Server::stop`], but running episodes continue when the next server on the same runs
    /// folder restores them.
    pub fn stop_keeping(self) -> Vec<String> {
        self.stop_for(true)
    }

    fn stop_for(self, keep: bool) -> Vec<String> {
        let Server { runtime, table, stop, served, settings, .. } = self;
        let _ = stop.send(());
        runtime.block_on(async {
            let left = table.close_all(settings.stop_timeout, keep).await;
            if !left.is_empty() {
                tracing::error!(left = left.join(", "), "ending without these, which did not end in time");
            }
            // A client that never finishes its request must not keep the process alive; the recordings
            // are closed by now.
            if tokio::time::timeout(REQUEST_GRACE, served).await.is_err() {
                tracing::warn!("a request was cut off");
            }
            left
        })
    }
}

async fn look_after(table: Arc<EpisodeTable>) {
    let mut ticks = interval(TIDY_INTERVAL);
    for tick in 0u64.. {
        ticks.tick().await;
        table.tidy_up();
        if tick.is_multiple_of(TICKS_PER_LOOK) {
            table.look_around();
        }
    }
}

/// Source of the request to end this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShutdownSignal {
    /// The keyboard, by SIGINT.
    Interrupt,
    /// A supervisor, by SIGTERM, or a closed terminal, by SIGHUP.
    Terminate,
}

/// Waits for a request to end this process.
#[cfg(unix)]
pub async fn shutdown_signal() -> ShutdownSignal {
    use tokio::signal::unix::{SignalKind, signal};
    let terminate = async {
        match signal(SignalKind::terminate()) {
            Ok(mut signals) => drop(signals.recv().await),
            Err(error) => {
                tracing::error!(%error, "SIGTERM is not heard; SIGINT is");
                std::future::pending().await
            }
        }
    };
    let hang_up = async {
        // A process started by nohup is meant to outlive its terminal.
        match is_hangup_ignored() {
            false => match signal(SignalKind::hangup()) {
                Ok(mut signals) => drop(signals.recv().await),
                Err(_) => std::future::pending().await,
            },
            true => std::future::pending().await,
        }
    };
    tokio::select! {
        _ = tokio::signal::ctrl_c() => ShutdownSignal::Interrupt,
        () = terminate => ShutdownSignal::Terminate,
        () = hang_up => ShutdownSignal::Terminate,
    }
}

/// Returns true if the process was started with SIGHUP ignored. The first call must precede the signal
/// handler.
#[cfg(unix)]
fn is_hangup_ignored() -> bool {
    use std::{mem, ptr, sync::OnceLock};
    static IGNORED: OnceLock<bool> = OnceLock::new();
    *IGNORED.get_or_init(|| {
        #[allow(unsafe_code, reason = "no safe wrapper reads the action of a signal without replacing it")]
        // SAFETY: zeros are a valid `sigaction`; without a new action, the call only writes the old one.
        unsafe {
            let mut action: libc::sigaction = mem::zeroed();
            libc::sigaction(libc::SIGHUP, ptr::null(), &mut action) == 0
                && action.sa_sigaction == libc::SIG_IGN
        }
    })
}

/// Waits for a request to end this process.
#[cfg(not(unix))]
pub async fn shutdown_signal() -> ShutdownSignal {
    let _ = tokio::signal::ctrl_c().await;
    ShutdownSignal::Interrupt
}
