//! A WebSocket as pages have it. RFC 6455; frames are tungstenite's.

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

/// A page that takes nothing for so long has gone.
const WRITE_LIMIT: Duration = Duration::from_secs(10);

/// The most that a page says at once.
const MAX_BYTES: u64 = 4096;

/// The two ends of a socket.
pub struct PageSocket {
    /// What the page is told by.
    pub sender: PageSender,
    /// What the page says, or that it has gone.
    pub reader: PageReader,
}

/// Tells a page.
#[derive(Clone)]
pub struct PageSender(Arc<Mutex<WriteHalf<TokioIo<Upgraded>>>>);

/// Hears a page, and answers its pings.
pub struct PageReader {
    half: ReadHalf<TokioIo<Upgraded>>,
    /// By which pings are answered.
    sender: PageSender,
    /// What has come of the next frame.
    arrived: Vec<u8>,
}

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
    /// Returns when the page has gone, whatever it has said until then.
    pub async fn gone(&mut self) {
        while let Ok(Some(_)) = self.text().await {}
    }

    /// The next text of a page; `None` once it has gone. What is no whole text of a reasonable length ends it.
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
                        // Whoever closes first has gone when it has heard this.
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

    /// Takes a frame out of what has arrived, if a whole one has.
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
        let (half, sender) = split(TokioIo::new(upgraded));
        let sender = PageSender(Arc::new(Mutex::new(sender)));
        let reader = PageReader { half, sender: sender.clone(), arrived: Vec::new() };
        // A page that has gone is no error.
        let _ = serve(PageSocket { sender, reader }).await;
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
