//! The service as its users meet it: the real binary on a free port, spoken to over HTTP.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails where it is")]

mod bad_input;
mod browser;
mod caching;
mod cancel;
mod crash;
mod drain;
mod fairness;
mod idempotency;
mod listing;
mod round_trip;
mod samples;
mod server;
