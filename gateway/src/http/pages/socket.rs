//! WebSocket connections of pages (RFC 6455), with tungstenite's frames.

use std::{
    io::{self, Cursor},
    sync::Arc,
    time::Duration,
};

use axum::{
    extract::Request,
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use hyper::upgrade::{OnUpgrade, Upgraded};
use hyper_util::rt::TokioIo;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, ReadHalf, WriteHalf, split},
    sync::Mutex,
    time::timeout,
};
use tungstenite::{
    handshake::derive_accept_key,
    protocol::frame::{
        Frame, FrameHeader,
        coding::{Control, Data, OpCode},
    },
};

use crate::http::problem::ApiError;

/// Time without progress after which a page counts as disconnected.
const WRITE_LIMIT: Duration = Duration::from_secs(10);

/// Maximum length of a message from a page in bytes.
const MAX_BYTES: u64 = 4096;

/// Both ends of a socket.
pub struct PageSocket {
    /// Sending end.
    pub sender: PageSender,
    /// Receiving end.
    pub reader: PageReader,
}

/// Sending end of a page's socket.
#[derive(Clone)]
pub struct PageSender(Arc<Mutex<WriteHalf<TokioIo<Upgraded>>>>);

/// Receiving end of a page's socket; it also answers pings.
pub struct PageReader {
    half: ReadHalf<TokioIo<Upgraded>>,
    /// Sender for answers to pings.
    sender: PageSender,
    /// Received part of the next frame.
    arrived: Vec<u8>,
}

impl PageSender {
    /// Sends a text message.
    pub async fn text(&mut self, text: String) -> io::Result<()> {
        self.send(Frame::message(text.into_bytes(), OpCode::Data(Data::Text), true)).await
    }

    /// Sends a binary message.
    pub async fn bytes(&mut self, bytes: Vec<u8>) -> io::Result<()> {
        self.send(Frame::message(bytes, OpCode::Data(Data::Binary), true)).await
    }

    /// Sends the close frame.
    pub async fn close(mut self) -> io::Result<()> {
        self.send(Frame::close(None)).await?;
        self.0.lock().await.shutdown().await
    }

    async fn send(&mut self, frame: Frame) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(frame.len());
        frame.format(&mut bytes).map_err(io::Error::other)?;
        let sent = async {
            let mut half = self.0.lock().await;
            half.write_all(&bytes).await?;
            half.flush().await
        };
        timeout(WRITE_LIMIT, sent).await.map_err(|_| io::Error::from(io::ErrorKind::TimedOut))?
    }
}

impl PageReader {
    /// Returns when the page has disconnected. Messages before that are ignored.
    pub async fn gone(&mut self) {
        while let Ok(Some(_)) = self.text().await {}
    }

    /// Returns the next text of a page, or `None` once it has disconnected. Any message except a complete
    /// text of limited length ends the connection.
    pub async fn text(&mut self) -> io::Result<Option<String>> {
        loop {
            if let Some((opcode, bytes)) = self.frame()? {
                match opcode {
                    OpCode::Data(Data::Text) => {
                        return String::from_utf8(bytes).map(Some).map_err(io::Error::other);
                    }
                    OpCode::Control(Control::Ping) => self.sender.send(Frame::pong(bytes)).await?,
                    OpCode::Control(Control::Pong) => {}
                    OpCode::Control(Control::Close) => {
                        // The page has closed first, and disconnects when it receives this frame.
                        let _ = self.sender.send(Frame::close(None)).await;
                        return Ok(None);
                    }
                    OpCode::Data(_) | OpCode::Control(_) => return Ok(None),
                }
                continue;
            }
            if self.half.read_buf(&mut self.arrived).await? == 0 {
                return Ok(None);
            }
        }
    }

    /// Removes a frame from the received bytes, if they contain a complete one.
    fn frame(&mut self) -> io::Result<Option<(OpCode, Vec<u8>)>> {
        let mut cursor = Cursor::new(&self.arrived[..]);
        let Some((header, length)) = FrameHeader::parse(&mut cursor).map_err(io::Error::other)? else {
            return Ok(None);
        };
        let Some(mask) = header.mask.filter(|_| header.is_final && length <= MAX_BYTES) else {
            return Err(io::Error::other("a page sends whole, short, masked frames"));
        };
        let begin = cursor.position() as usize;
        let end = begin + length as usize;
        if self.arrived.len() < end {
            return Ok(None);
        }
        let bytes = self.arrived[begin..end].iter().zip(mask.iter().cycle()).map(|(byte, mask)| byte ^ mask);
        let bytes = bytes.collect();
        self.arrived.drain(..end);
        Ok(Some((header.opcode, bytes)))
    }
}

/// Answers a request for a WebSocket and runs the future that `serve` returns.
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
        let (half, sender) = split(TokioIo::new(upgraded));
        let sender = PageSender(Arc::new(Mutex::new(sender)));
        let reader = PageReader { half, sender: sender.clone(), arrived: Vec::new() };
        // A page that has disconnected is not an error.
        let _ = serve(PageSocket { sender, reader }).await;
    });
    let headers = [
        (header::CONNECTION, HeaderValue::from_static("upgrade")),
        (header::UPGRADE, HeaderValue::from_static("websocket")),
        (header::SEC_WEBSOCKET_ACCEPT, accepted),
    ];
    Ok((StatusCode::SWITCHING_PROTOCOLS, headers).into_response())
}

/// Returns the answer to the key of a request for a WebSocket of version 13.
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
