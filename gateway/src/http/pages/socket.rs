//! A WebSocket as pages have it: the server tells, and reads only to notice that the page has gone. RFC 6455; frames are tungstenite's.

use std::{io, time::Duration};

use axum::{
    extract::Request,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use hyper::upgrade::{OnUpgrade, Upgraded};
use hyper_util::rt::TokioIo;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, ReadHalf, WriteHalf, split},
    time::timeout,
};
use tungstenite::{
    handshake::derive_accept_key,
    protocol::frame::{
        Frame,
        coding::{Data, OpCode},
    },
};

use crate::http::problem::ApiError;

/// A page that takes nothing for so long has gone.
const WRITE_LIMIT: Duration = Duration::from_secs(10);

/// The two ends of a socket.
pub struct PageSocket {
    /// What the page is told by.
    pub sender: PageSender,
    /// Where the page's end is noticed.
    pub closing: PageClosing,
}

/// Tells a page.
pub struct PageSender(WriteHalf<TokioIo<Upgraded>>);

/// Notices that a page has gone.
pub struct PageClosing(ReadHalf<TokioIo<Upgraded>>);

impl PageSender {
    /// Sends a text.
    pub async fn text(&mut self, text: String) -> io::Result<()> {
        self.send(Frame::message(text.into_bytes(), OpCode::Data(Data::Text), true)).await
    }

    /// Sends bytes.
    pub async fn bytes(&mut self, bytes: Vec<u8>) -> io::Result<()> {
        self.send(Frame::message(bytes, OpCode::Data(Data::Binary), true)).await
    }

    /// Says that nothing more comes.
    pub async fn close(mut self) -> io::Result<()> {
        self.send(Frame::close(None)).await?;
        self.0.shutdown().await
    }

    async fn send(&mut self, frame: Frame) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(frame.len());
        frame.format(&mut bytes).map_err(io::Error::other)?;
        let sent = async {
            self.0.write_all(&bytes).await?;
            self.0.flush().await
        };
        timeout(WRITE_LIMIT, sent).await.map_err(|_| io::Error::from(io::ErrorKind::TimedOut))?
    }
}

impl PageClosing {
    /// Returns when the page has gone. A page has nothing to say, so what it sends ends it, too: a close frame, as a rule.
    pub async fn gone(&mut self) {
        let mut first = [0; 1];
        let _ = self.0.read(&mut first).await;
    }
}

/// Answers a request for a WebSocket, and has `serve` make what serves it.
pub fn upgrade<Served>(
    mut request: Request,
    serve: impl FnOnce(PageSocket) -> Served + Send + 'static,
) -> Result<Response, ApiError>
where
    Served: Future<Output = io::Result<()>> + Send + 'static,
{
    let accepted = accept(request.headers()).ok_or_else(no_socket)?;
    let upgrade = request.extensions_mut().remove::<OnUpgrade>().ok_or_else(no_socket)?;
    tokio::spawn(async move {
        let Ok(upgraded) = upgrade.await else { return };
        let (closing, sender) = split(TokioIo::new(upgraded));
        // A page that has gone is no error.
        let _ = serve(PageSocket { sender: PageSender(sender), closing: PageClosing(closing) }).await;
    });
    let headers = [
        (header::CONNECTION, HeaderValue::from_static("upgrade")),
        (header::UPGRADE, HeaderValue::from_static("websocket")),
        (header::SEC_WEBSOCKET_ACCEPT, accepted),
    ];
    Ok((StatusCode::SWITCHING_PROTOCOLS, headers).into_response())
}

/// The answer to the key of a request for a WebSocket of version 13.
fn accept(headers: &HeaderMap) -> Option<HeaderValue> {
    let text = |name| headers.get(name).and_then(|value: &HeaderValue| value.to_str().ok());
    let wants = text(header::UPGRADE)?.eq_ignore_ascii_case("websocket");
    let version = text(header::SEC_WEBSOCKET_VERSION)? == "13";
    let key = headers.get(header::SEC_WEBSOCKET_KEY).filter(|_| wants && version)?;
    derive_accept_key(key.as_bytes()).parse().ok()
}

fn no_socket() -> ApiError {
    let detail =
        "this is a WebSocket; ask for it with Upgrade: websocket and Sec-WebSocket-Version: 13".into();
    ApiError::Protocol { status: StatusCode::UPGRADE_REQUIRED, detail }
}
