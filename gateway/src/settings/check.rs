//! Checks of settings that need no file.

use std::net::IpAddr;

use tandem_episodes::stress::StressAxis;

use super::{Layer, Record, SettingsError};

impl Layer {
    /// Refuses values that would make a server unusable.
    pub fn check(&self) -> Result<(), SettingsError> {
        let numbers = [
            ("thinking_limit", self.thinking_limit.map(u64::from), "3600"),
            ("max_episodes", self.max_episodes.map(u64::from), "8"),
            ("max_body_bytes", self.max_body_bytes.map(|bytes| bytes as u64), "2000000"),
            ("request_timeout", self.request_timeout.map(u64::from), "30"),
            ("max_requests", self.max_requests.map(|requests| requests as u64), "256"),
            ("rate_limit", self.rate_limit.map(u64::from), "100"),
            ("idle_timeout", self.idle_timeout.map(u64::from), "900"),
        ];
        if let Some((setting, _, example)) = numbers.into_iter().find(|(_, given, _)| *given == Some(0)) {
            return Err(SettingsError::Zero { setting, example });
        }
        if self.level.is_some() && self.stress.is_none() {
            return Err(SettingsError::LevelAlone);
        }
        if self.stress == Some(StressAxis::Words) && self.instructions.is_some() {
            return Err(SettingsError::TwoWordings);
        }
        if self.foxglove.is_some() && self.record == Some(Record::After) {
            return Err(SettingsError::LiveAfter);
        }
        match self.allowed_host.iter().flatten().find(|name| !is_host(name)) {
            Some(name) => Err(SettingsError::NoHost { name: name.clone() }),
            None => Ok(()),
        }
    }
}

/// Returns true if a text is a host name without a port.
fn is_host(name: &str) -> bool {
    let part = |part: &str| {
        !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte))
    };
    name.split('.').all(part) || name.parse::<IpAddr>().is_ok()
}
