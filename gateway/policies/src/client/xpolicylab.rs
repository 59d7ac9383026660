//! XPolicyLab's protocol: msgpack messages over WebSocket. Each message is answered by a message with the
//! same `message_id`.
//!
//! A server has one model, which any client can reset with the message `reset`.

use std::{
    fmt::Write,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use rmpv::Value;

use super::{
    PolicyAddress, PolicyClient,
    link::{Frame, PolicySocket, silent},
    msgpack::{Dialect, bytes_of, entry, kind, read, reply_value, request_value, text},
};
use crate::{
    error::{RemoteError, gist},
    values::{ReplyValue, RequestValue},
};

/// Time limit for messages whose answers do not matter: the end of an episode, and heartbeats.
const COURTESY: Duration = Duration::from_secs(2);

/// Format of observations, as XPolicyLab names it.
const DATA_FORMAT: &str = "v1.0";

/// A connection to one server.
pub struct XPolicyLab {
    socket: PolicySocket,
    /// Unique id of this client. A server repeats its earlier answer if it already knows a message id.
    evaluation: String,
    /// Name of the task.
    case: String,
    messages: u64,
    trials: u64,
    /// Number of requests in the open trial; `None` if no trial is open.
    trial: Option<u64>,
}

/// Type of a request.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Request {
    Hello,
    PrepareCase,
    Reset,
    Infer,
    TrialEnd,
    Heartbeat,
    Close,
}

impl Request {
    fn name(self) -> &'static str {
        match self {
            Request::Hello => "hello",
            Request::PrepareCase => "prepare_case",
            Request::Reset => "reset",
            Request::Infer => "infer",
            Request::TrialEnd => "trial_end",
            Request::Heartbeat => "heartbeat",
            Request::Close => "close",
        }
    }

    /// Returns the message type of the answer to the request.
    fn answer(self) -> String {
        match self {
            Request::Reset | Request::Infer => format!("{}_result", self.name()),
            _ => format!("{}_ack", self.name()),
        }
    }
}

impl XPolicyLab {
    /// Connects, sends the hello and the task, and begins a trial.
    pub fn connect(
        address: &PolicyAddress,
        task: &str,
        connect_within: Duration,
        reply_within: Duration,
    ) -> Result<XPolicyLab, RemoteError> {
        let (url, within) = (address.url.as_str(), connect_within.max(reply_within));
        let mut name = [0; 8];
        getrandom::fill(&mut name)
            .map_err(|error| RemoteError::Unreachable { url: url.into(), reason: error.to_string() })?;
        let evaluation = name.iter().fold("tandem-".to_owned(), |mut text, byte| {
            // Writing to a string cannot fail.
            let _ = write!(text, "{byte:02x}");
            text
        });
        let socket = PolicySocket::connect(address, connect_within, within)?;
        let case = task.to_owned();
        let mut link = XPolicyLab { socket, evaluation, case, messages: 0, trials: 0, trial: None };
        // A server with another protocol does not answer these messages.
        link.request(Request::Hello, Vec::new(), within).map_err(|error| match error {
            RemoteError::Slow { .. } => silent(url, within),
            error => error,
        })?;
        let case = link.case.as_str().into();
        link.request(Request::PrepareCase, vec![("action_case_id".into(), case)], within)?;
        link.begin_trial(within)?;
        Ok(link)
    }

    /// Sends a request and returns the payload of its answer.
    fn request(
        &mut self,
        request: Request,
        payload: Vec<(Value, Value)>,
        within: Duration,
    ) -> Result<Value, RemoteError> {
        let id = format!("{}-{}", self.evaluation, self.messages);
        self.messages += 1;
        let frame = self.frame(request, &id, payload);
        self.socket.send(bytes_of(&frame), within)?;
        if request == Request::Close {
            return Ok(Value::Nil);
        }
        loop {
            let bytes = match self.socket.hear(within)? {
                Frame::Bytes(bytes) => bytes,
                // XPolicyLab does not use text messages.
                Frame::Text(_) => continue,
            };
            let answer = read(&bytes).map_err(|reason| self.socket.unreadable(reason))?;
            let found = |key: &str| answer.as_map().and_then(|entries| entry(entries, key));
            let Some(came) = found("message_type").and_then(text) else {
                let reason = format!("expected a map that has a message_type; came a {}", kind(&answer));
                return Err(self.socket.unreadable(reason));
            };
            if found("message_id").and_then(text).as_deref() != Some(&id) {
                // The answer belongs to a request that is no longer pending.
                continue;
            }
            let payload = found("payload").cloned().unwrap_or(Value::Nil);
            if came == "error" {
                return Err(RemoteError::Failed { url: self.socket.url().into(), text: complaint(&payload) });
            }
            return match came == request.answer() {
                true => Ok(payload),
                false => {
                    let reason = format!("expected {:?}; came {came:?}", request.answer());
                    Err(self.socket.unreadable(reason))
                }
            };
        }
    }

    fn frame(&self, request: Request, id: &str, payload: Vec<(Value, Value)>) -> Value {
        let trial = self.trial.map(|_| self.trial_id());
        Value::Map(vec![
            ("message_type".into(), request.name().into()),
            ("message_id".into(), id.into()),
            ("evaluation_id".into(), self.evaluation.as_str().into()),
            ("action_case_id".into(), self.case.as_str().into()),
            ("trial_id".into(), trial.map_or(Value::Nil, Value::from)),
            ("repeat_index".into(), Value::Nil),
            ("step".into(), self.trial.unwrap_or(0).into()),
            ("sent_at".into(), utc_text(SystemTime::now()).into()),
            ("payload".into(), Value::Map(payload)),
        ])
    }

    /// Returns the id of the open trial, or of the last trial if none is open.
    fn trial_id(&self) -> String {
        format!("{}-{}", self.case, self.trials)
    }

    fn end_trial(&mut self, within: Duration) -> Result<(), RemoteError> {
        if self.trial.is_none() {
            return Ok(());
        }
        let payload = vec![("trial_id".into(), self.trial_id().into())];
        let ended = self.request(Request::TrialEnd, payload, within);
        self.trial = None;
        ended.map(drop)
    }
}

impl PolicyClient for XPolicyLab {
    fn ask(&mut self, request: &RequestValue, within: Duration) -> Result<ReplyValue, RemoteError> {
        let mut observation = request_value(request, Dialect::MsgpackNumpy);
        if let Value::Map(entries) = &mut observation
            && entry(entries, "data_format_version").is_none()
        {
            entries.insert(0, ("data_format_version".into(), DATA_FORMAT.into()));
        }
        let answer = self.request(Request::Infer, vec![("observation".into(), observation)], within);
        match answer {
            Ok(payload) => {
                self.trial = self.trial.map(|requests| requests + 1);
                actions(payload).map_err(|reason| self.socket.unreadable(reason))
            }
            Err(error) => {
                // A server that does not answer this request would not receive the end of the trial, either.
                if !matches!(error, RemoteError::Failed { .. }) {
                    self.trial = None;
                }
                Err(error)
            }
        }
    }

    fn begin_trial(&mut self, within: Duration) -> Result<(), RemoteError> {
        self.end_trial(within)?;
        self.trials += 1;
        self.trial = Some(0);
        let payload = vec![("trial_id".into(), self.trial_id().into())];
        self.request(Request::Reset, payload, within).map(drop)
    }

    fn keep_alive(&mut self) {
        // If the connection is broken, the next request fails. Pings from the server are also answered here.
        let _ = self.request(Request::Heartbeat, Vec::new(), COURTESY);
    }
}

impl Drop for XPolicyLab {
    fn drop(&mut self) {
        // The episode is over even if the server does not receive this.
        if self.trial.is_some() && self.end_trial(COURTESY).is_ok() {
            let _ = self.request(Request::Close, Vec::new(), COURTESY);
        }
    }
}

/// Returns the description of a failure that the server has sent.
fn complaint(payload: &Value) -> String {
    let found = |key: &str| payload.as_map().and_then(|entries| entry(entries, key)).and_then(text);
    let code = found("code").unwrap_or_else(|| "error".into());
    match found("message") {
        Some(message) => format!("{code}: {}", gist(&message)),
        None => code,
    }
}

/// Converts an answer to the form that maps expect: `actions` becomes one map of arrays with one row per
/// action. The server sends a list of maps with one map per action, or a single map.
fn actions(payload: Value) -> Result<ReplyValue, String> {
    let Value::Map(entries) = payload else {
        return Err(format!("expected a payload; came a {}", kind(&payload)));
    };
    let Some(actions) = entry(&entries, "actions").cloned() else {
        let keys: Vec<String> = entries.iter().filter_map(|(key, _)| text(key)).collect();
        return Err(format!("expected actions; came {}", keys.join(", ")));
    };
    let told = match actions {
        Value::Array(rows) if rows.first().is_some_and(Value::is_map) => by_key(rows)?,
        other => reply_value(other)?,
    };
    Ok(ReplyValue::Map(vec![("actions".into(), told)]))
}

/// Combines maps with one row each into one map, which has a table of rows for each key.
fn by_key(rows: Vec<Value>) -> Result<ReplyValue, String> {
    let mut columns: Vec<(String, Vec<ReplyValue>)> = Vec::new();
    for (number, row) in rows.into_iter().enumerate() {
        let ReplyValue::Map(entries) = reply_value(row)? else {
            return Err(format!("action {number} is no map, as the first is"));
        };
        for (key, value) in entries {
            match columns.iter_mut().find(|(known, _)| *known == key) {
                Some((_, values)) if values.len() == number => values.push(value),
                None if number == 0 => columns.push((key, vec![value])),
                _ => return Err(format!("action {number} has {key:?}, and not every one before it")),
            }
        }
        if let Some((key, _)) = columns.iter().find(|(_, values)| values.len() == number) {
            return Err(format!("action {number} has no {key:?}, as those before it"));
        }
    }
    let joined = columns.into_iter().map(|(key, values)| (key, ReplyValue::list(values)));
    Ok(ReplyValue::Map(joined.collect()))
}

const SECONDS_PER_DAY: u64 = 86_400;

/// Formats a time as ISO 8601 in UTC. Conversion of days to a date: Hinnant, "chrono-compatible low-level
/// date algorithms", 2013.
fn utc_text(at: SystemTime) -> String {
    let since_s = at.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (days, in_day) = (since_s / SECONDS_PER_DAY + 719_468, since_s % SECONDS_PER_DAY);
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    let year = year + era * 400 + u64::from(month <= 2);
    let (hour, minute, second) = (in_day / 3600, in_day / 60 % 60, in_day % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}+00:00")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(entries: &[(&str, Value)]) -> Value {
        Value::Map(entries.iter().map(|(key, value)| ((*key).into(), value.clone())).collect())
    }

    fn row(values: &[f64]) -> Value {
        Value::Array(values.iter().map(|value| Value::F64(*value)).collect())
    }

    #[test]
    fn rows_of_actions_become_columns() {
        let of = |actions_told: Value| actions(map(&[("latency_ms", 3.into()), ("actions", actions_told)]));
        let first = map(&[("arm", row(&[1.0, 2.0])), ("hand", row(&[3.0]))]);
        let second = map(&[("hand", row(&[6.0])), ("arm", row(&[4.0, 5.0]))]);
        let told = of(Value::Array(vec![first.clone(), second])).unwrap();
        let array = |shape: &[usize], values: &[f64]| ReplyValue::Array {
            shape: shape.into(),
            values: values.into(),
        };
        assert_eq!(told.at("actions > arm"), Some(&array(&[2, 2], &[1.0, 2.0, 4.0, 5.0])));
        assert_eq!(told.at("actions > hand"), Some(&array(&[2, 1], &[3.0, 6.0])));
        assert_eq!(of(first.clone()).unwrap().at("actions > arm"), Some(&array(&[2], &[1.0, 2.0])));
        assert_eq!(of(row(&[1.0, 2.0])).unwrap().at("actions"), Some(&array(&[2], &[1.0, 2.0])));

        let fails = |actions_told: Vec<Value>, says: &str| {
            let reason = of(Value::Array(actions_told)).unwrap_err();
            assert_eq!(reason, says);
        };
        fails(
            vec![first.clone(), map(&[("arm", row(&[4.0, 5.0]))])],
            "action 1 has no \"hand\", as those before it",
        );
        let more = map(&[("leg", row(&[1.0])), ("arm", row(&[4.0, 5.0]))]);
        fails(vec![first.clone(), more], "action 1 has \"leg\", and not every one before it");
        fails(vec![first, 1.into()], "action 1 is no map, as the first is");
        assert_eq!(actions(map(&[("ok", true.into())])).unwrap_err(), "expected actions; came ok");
    }

    #[test]
    fn times_are_written_as_dates() {
        let text = |since_s: u64| utc_text(UNIX_EPOCH + Duration::from_secs(since_s));
        assert_eq!(text(0), "1970-01-01T00:00:00+00:00");
        assert_eq!(text(951_782_399), "2000-02-28T23:59:59+00:00");
        assert_eq!(text(951_782_400), "2000-02-29T00:00:00+00:00");
        assert_eq!(text(1_795_469_405), "2026-11-23T21:30:05+00:00");
    }
}
