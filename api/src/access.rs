//! Who is asking: the key that a request brings, and how often it may come.

use crate::AppState;
use crate::config::Settings;
use crate::jobs::Owner;
use crate::problem::Problem;
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, header};
use governor::clock::{Clock, DefaultClock};
use governor::{DefaultKeyedRateLimiter, Quota, RateLimiter};
use std::net::{IpAddr, SocketAddr};
use std::num::NonZeroU32;
use std::time::Duration;

/// The cookie by which the web page shows its key: scripts cannot read it, other sites cannot send it.
pub(crate) const COOKIE: &str = "nephroid_key";
/// More callers than this are remembered for a moment only.
const MANY_CALLERS: usize = 10_000;

/// The address that a connection comes from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peer(pub(crate) SocketAddr);

/// Who is asking. A handler that takes one is open only to whoever may use the service, as often as they may.
#[derive(Clone, Debug)]
pub(crate) struct Caller(pub(crate) Owner);

impl FromRequestParts<AppState> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, app: &AppState) -> Result<Self, Problem> {
        let owner = owner_of(&parts.headers, app).await?;
        let peer = parts.extensions.get::<Peer>().map(|peer| peer.0.ip());
        app.rates.check(&owner, peer)?;
        Ok(Self(owner))
    }
}

/// The owner whose key the request brings, or nobody in particular where none is needed.
pub(crate) async fn owner_of(headers: &HeaderMap, app: &AppState) -> Result<Owner, Problem> {
    let Some(token) = token_of(headers)? else {
        if app.settings.open || !app.jobs.has_keys().await? {
            return Ok(Owner::anonymous());
        }
        return Err(Problem::unauthorized("Send the header \"Authorization: Bearer …\" with an API key."));
    };
    let owner = app.jobs.owner_of(token).await?;
    owner.ok_or_else(|| Problem::unauthorized("This API key is not known, or was revoked."))
}

fn token_of(headers: &HeaderMap) -> Result<Option<&str>, Problem> {
    if let Some(value) = headers.get(header::AUTHORIZATION) {
        let words = value.to_str().ok().and_then(|text| text.split_once(' '));
        let token =
            words.filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer")).map(|(_, token)| token.trim());
        return token.map(Some).ok_or_else(|| Problem::unauthorized("`Authorization` must be \"Bearer …\"."));
    }
    Ok(cookie_of(headers))
}

/// The page's cookie, unless another site had the browser send it.
fn cookie_of(headers: &HeaderMap) -> Option<&str> {
    let site = headers.get("sec-fetch-site").and_then(|value| value.to_str().ok());
    if !matches!(site, None | Some("same-origin" | "none")) {
        return None;
    }
    let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
    let mut pairs = cookies.flat_map(|list| list.split(';')).filter_map(|pair| pair.trim().split_once('='));
    pairs.find(|(name, value)| *name == COOKIE && !value.is_empty()).map(|(_, value)| value)
}

/// How often each caller has come lately.
#[derive(Debug)]
pub(crate) struct Rates {
    limiter: Option<DefaultKeyedRateLimiter<RateKey>>,
    limit: u32,
}

/// What a rate is counted for.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum RateKey {
    Owner(Owner),
    Address(IpAddr),
}

impl Rates {
    pub(crate) fn new(settings: &Settings) -> Self {
        let limit = settings.rate;
        let quota = NonZeroU32::new(limit).map(|rate| {
            Quota::per_second(rate).allow_burst(rate.saturating_mul(NonZeroU32::MIN.saturating_add(1)))
        });
        Self { limiter: quota.map(RateLimiter::keyed), limit }
    }

    fn check(&self, owner: &Owner, peer: Option<IpAddr>) -> Result<(), Problem> {
        let key = match peer {
            _ if !owner.is_anonymous() => RateKey::Owner(owner.clone()),
            Some(address) if !address.is_loopback() => RateKey::Address(address),
            // Whoever is on this machine already and needs no key can do worse.
            _ => return Ok(()),
        };
        let Some(limiter) = &self.limiter else { return Ok(()) };
        if limiter.len() > MANY_CALLERS {
            limiter.retain_recent();
        }
        limiter.check_key(&key).map_err(|refused| {
            let wait = refused.wait_time_from(DefaultClock::default().now());
            Problem::rate_limited(whole_seconds(wait), self.limit)
        })
    }
}

/// Rounded up: whoever waits so long is not refused again.
fn whole_seconds(wait: Duration) -> u32 {
    u32::try_from(wait.as_millis().div_ceil(1000)).unwrap_or(u32::MAX).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderName;

    fn headers(pairs: &[(&'static str, &str)]) -> HeaderMap {
        pairs.iter().map(|(name, value)| (HeaderName::from_static(name), value.parse().unwrap())).collect()
    }

    #[test]
    fn a_key_comes_as_bearer_or_as_the_cookie_of_the_same_origin() {
        let token = |pairs: &[(&'static str, &str)]| {
            token_of(&headers(pairs)).map(|token| token.map(str::to_owned)).ok()
        };
        assert_eq!(token(&[]), Some(None));
        assert_eq!(token(&[("authorization", "bearer abc")]), Some(Some("abc".into())));
        assert_eq!(token(&[("authorization", "Basic abc")]), None);
        assert_eq!(token(&[("cookie", "a=b; nephroid_key=abc")]), Some(Some("abc".into())));
        let foreign = [("cookie", "nephroid_key=abc"), ("sec-fetch-site", "same-site")];
        assert_eq!(token(&foreign), Some(None), "a page of another port cannot use it");
    }

    #[test]
    fn a_wait_is_rounded_up_to_seconds() {
        assert_eq!([1, 1000, 1001].map(|ms| whole_seconds(Duration::from_millis(ms))), [1, 1, 2]);
    }
}
