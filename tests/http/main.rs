//! The service as its users meet it: the real binary on a free port, spoken to over HTTP.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails where it is")]

mod abuse;
mod assets;
mod bad_input;
mod browser;
mod caching;
mod cancel;
mod contract;
mod crash;
mod drain;
mod events;
mod fairness;
mod idempotency;
mod keys;
mod kill;
mod listing;
mod observe;
mod retention;
mod round_trip;
mod samples;
mod server;
