//! Accepts connections and serves each until the server stops, with time limits on request headers and on
//! idle connections. If the server has a certificate, connections are encrypted.

use std::{io, sync::Arc, time::Duration};

use axum::Router;
use hyper::{
    Request,
    body::Incoming,
    server::conn::http1,
    service::{Service, service_fn},
};
use hyper_util::{rt::TokioIo, service::TowerToHyperService};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
    sync::watch,
    task::JoinSet,
    time::{sleep, timeout},
};
use tokio_rustls::{TlsAcceptor, server::TlsStream};

use super::{
    limits::Peer,
    waiting::{Connection, GoodCall, NotedStream, WaitTimer, WaitingConnections},
};
use crate::{http::problem::ApiError, settings::Certificate};

/// Delay after the system has refused a connection, for example because all file handles are in use.
const ACCEPT_RETRY_DELAY: Duration = Duration::from_millis(200);

/// First byte of a TLS connection: the type of a handshake record.
const TLS_HANDSHAKE: u8 = 22;

/// Data that is needed to serve a connection.
#[derive(Clone)]
struct Serving {
    router: Router,
    header_limit: Duration,
    stopping: watch::Receiver<bool>,
}

/// Limits on connections.
#[derive(Debug, Clone, Copy)]
pub struct ConnectionLimits {
    /// Time limit for a request's header.
    pub header: Duration,
    /// Maximum number of connections of one address that wait for a request.
    pub max_waiting_per_address: usize,
}

/// Serves `router` until `stopped` completes, then lets the pending requests finish.
pub async fn serve(
    listener: TcpListener,
    certificate: Option<Certificate>,
    router: Router,
    limits: ConnectionLimits,
    stopped: impl Future<Output = ()>,
) {
    let (stop, stopping) = watch::channel(false);
    let serving = Serving { router, header_limit: limits.header, stopping };
    let waiting = Arc::new(WaitingConnections::new(limits.max_waiting_per_address));
    let tls = certificate.map(|Certificate(config)| TlsAcceptor::from(config));
    let mut connections = JoinSet::new();
    let accepting = async {
        loop {
            match listener.accept().await {
                Ok((stream, peer)) => {
                    let (serving, tls) = (serving.clone(), tls.clone());
                    let connection = waiting.enter(peer.ip(), limits.header);
                    connections.spawn(async move {
                        let served = async {
                            match tls {
                                Some(tls) => serving.encrypted(stream, tls, connection.clone()).await,
                                None => serving.connection(stream, connection.clone()).await,
                            }
                        };
                        tokio::select! {
                            () = served => {}
                            () = connection.crowded_out() => {
                                tracing::info!("a connection was closed: too many of its address wait for a request");
                            }
                        }
                    });
                    while connections.try_join_next().is_some() {}
                }
                Err(error) => {
                    tracing::warn!(%error, "a connection was not accepted");
                    sleep(ACCEPT_RETRY_DELAY).await;
                }
            }
        }
    };
    tokio::select! {
        () = accepting => {}
        () = stopped => {}
    }
    drop(listener);
    stop.send_replace(true);
    while connections.join_next().await.is_some() {}
}

impl Serving {
    /// Serves a connection that has to be encrypted. A client that sends plain HTTP receives an explanation.
    async fn encrypted(self, stream: TcpStream, tls: TlsAcceptor, connection: Arc<Connection>) {
        let mut stopping = self.stopping.clone();
        let begun = tokio::select! {
            begun = timeout(self.header_limit, begin(stream, tls)) => begun,
            _ = stopping.wait_for(|stopping| *stopping) => return,
        };
        match begun {
            Ok(Ok(Begun::Encrypted(stream))) => self.connection(*stream, connection).await,
            Ok(Ok(Begun::Plain(stream))) => {
                let router = Router::new().fallback(|| async { ApiError::NotEncrypted });
                Serving { router, ..self }.connection(stream, connection).await;
            }
            Ok(Err(error)) => tracing::info!(%error, "a connection was not encrypted"),
            Err(_) => tracing::info!("a connection was not encrypted in time"),
        }
    }

    async fn connection(
        self,
        stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
        connection: Arc<Connection>,
    ) {
        let Serving { router, header_limit, mut stopping } = self;
        let router = TowerToHyperService::new(router);
        let answering = connection.clone();
        let with_peer = service_fn(move |mut request: Request<Incoming>| {
            request.extensions_mut().insert(Peer(answering.address()));
            request.extensions_mut().insert(answering.clone());
            let (answer, connection) = (router.call(request), answering.clone());
            async move {
                let answer = answer.await?;
                if answer.extensions().get::<GoodCall>().is_some() {
                    connection.trust();
                }
                Ok::<_, std::convert::Infallible>(answer)
            }
        });
        let stream = NotedStream { connection: connection.clone(), stream };
        let connection = http1::Builder::new()
            .timer(WaitTimer(connection))
            .header_read_timeout(header_limit)
            .serve_connection(TokioIo::new(stream), with_peer)
            .with_upgrades();
        let mut connection = std::pin::pin!(connection);
        let stopped = async move {
            let _ = stopping.wait_for(|stopping| *stopping).await;
        };
        let served = tokio::select! {
            served = connection.as_mut() => served,
            () = stopped => {
                connection.as_mut().graceful_shutdown();
                connection.await
            }
        };
        if let Err(error) = served {
            tracing::info!(%error, "a connection broke");
        }
    }
}

/// A new connection, classified by its first byte.
enum Begun {
    Encrypted(Box<TlsStream<TcpStream>>),
    Plain(TcpStream),
}

async fn begin(stream: TcpStream, tls: TlsAcceptor) -> io::Result<Begun> {
    let mut first = [0];
    let seen = stream.peek(&mut first).await?;
    if seen == 1 && first[0] != TLS_HANDSHAKE {
        return Ok(Begun::Plain(stream));
    }
    Ok(Begun::Encrypted(Box::new(tls.accept(stream).await?)))
}
