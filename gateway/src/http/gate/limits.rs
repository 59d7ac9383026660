//! Limits on the number of concurrent requests and on the request rate of each address.

use std::{
    collections::HashMap,
    net::IpAddr,
    sync::{Arc, Mutex},
    time::Instant,
};

use axum::{
    extract::{Request, State},
    middleware::Next,
    response::{IntoResponse, Response},
};
use tokio::sync::Semaphore;

use super::waiting::Connection;
use crate::{http::problem::ApiError, settings::Settings};

/// Maximum number of remembered addresses. Beyond it, addresses with their full allowance are forgotten.
const MAX_ADDRESSES: usize = 1024;

/// Source address of a request.
#[derive(Debug, Clone, Copy)]
pub struct Peer(pub IpAddr);

/// Counters of concurrent requests and of each address's requests.
#[derive(Debug, Clone)]
pub struct Limits {
    permits: Arc<Semaphore>,
    most_requests: usize,
    rates: Option<Arc<Mutex<Rates>>>,
}

impl Limits {
    /// Creates the limits from `settings`.
    pub fn new(settings: &Settings) -> Limits {
        Limits {
            permits: Arc::new(Semaphore::new(settings.max_requests.min(Semaphore::MAX_PERMITS))),
            most_requests: settings.max_requests,
            rates: settings.rate_limit.map(|per_second| Arc::new(Mutex::new(Rates::new(per_second)))),
        }
    }

    fn check_rate(&self, peer: Option<&Peer>) -> Result<(), ApiError> {
        let (Some(rates), Some(Peer(address))) = (&self.rates, peer) else { return Ok(()) };
        // Every allowance stays valid even if a thread panics while it holds the lock.
        let mut rates = rates.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if rates.take(*address, Instant::now()) {
            return Ok(());
        }
        Err(ApiError::TooManyRequests { per_second: rates.per_second })
    }
}

/// Admits a request within the rate limit of its address, or answers with the time of the next attempt.
pub async fn pass_rate(State(limits): State<Limits>, request: Request, next: Next) -> Response {
    match limits.check_rate(request.extensions().get()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refused(refusal),
    }
}

/// Admits a request if there is a free slot, or answers with the time of the next attempt. By then the
/// request is complete and its caller identified, so a slow client never occupies a slot.
pub async fn take_place(State(limits): State<Limits>, request: Request, next: Next) -> Response {
    let Ok(_place) = limits.permits.try_acquire() else {
        return refused(ApiError::Busy { limit: limits.most_requests });
    };
    if let Some(connection) = request.extensions().get::<Arc<Connection>>() {
        connection.is_served();
    }
    next.run(request).await
}

fn refused(refusal: ApiError) -> Response {
    tracing::info!(problem = refusal.kind(), "a request was not let in");
    refusal.into_response()
}

/// Request allowance of each address. It refills at a constant rate, up to the requests of one second.
#[derive(Debug)]
struct Rates {
    per_second: u32,
    /// Number of allowed requests, and the time at which that was computed.
    allowances: HashMap<IpAddr, (f64, Instant)>,
}

impl Rates {
    fn new(per_second: u32) -> Rates {
        Rates { per_second, allowances: HashMap::new() }
    }

    /// Returns true if `address` may send another request `now`, and counts it.
    fn take(&mut self, address: IpAddr, now: Instant) -> bool {
        let most = f64::from(self.per_second);
        let grown = |(allowed, since): (f64, Instant)| {
            (allowed + now.saturating_duration_since(since).as_secs_f64() * most).min(most)
        };
        if self.allowances.len() >= MAX_ADDRESSES && !self.allowances.contains_key(&address) {
            self.allowances.retain(|_, allowance| grown(*allowance) < most);
            if self.allowances.len() >= MAX_ADDRESSES {
                return false;
            }
        }
        let allowance = self.allowances.entry(address).or_insert((most, now));
        let allowed = grown(*allowance);
        let may = allowed >= 1.0;
        *allowance = (if may { allowed - 1.0 } else { allowed }, now);
        may
    }
}

#[cfg(test)]
mod tests {
    use std::{net::Ipv4Addr, time::Duration};

    use super::*;

    fn address(number: u32) -> IpAddr {
        Ipv4Addr::from_bits(number).into()
    }

    #[test]
    fn an_allowance_is_spent_and_grows_again() {
        let (mut rates, began) = (Rates::new(4), Instant::now());
        let mut at = |ms: u64, number: u32| rates.take(address(number), began + Duration::from_millis(ms));
        assert_eq!([at(0, 1), at(0, 1), at(0, 1), at(0, 1), at(0, 1)], [true, true, true, true, false]);
        assert!(at(0, 2), "every address has its own");
        assert_eq!([at(249, 1), at(251, 1), at(252, 1)], [false, true, false]);
        let burst: Vec<bool> = (0..5).map(|_| at(60_000, 1)).collect();
        assert_eq!(burst, [true, true, true, true, false], "never more than those of a second");
    }

    #[test]
    fn addresses_are_forgotten_that_have_their_allowance_back() {
        let (mut rates, began) = (Rates::new(1), Instant::now());
        for number in 0..MAX_ADDRESSES as u32 {
            assert!(rates.take(address(number), began));
        }
        assert!(!rates.take(address(u32::MAX), began), "no room to remember one more");
        let later = began + Duration::from_secs(2);
        assert!(rates.take(address(u32::MAX), later));
        assert_eq!(rates.allowances.len(), 1);
    }
}
