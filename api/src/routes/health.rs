//! `/healthz`, `/readyz`, `/metrics`: whether the process lives, whether it takes jobs, and its numbers.

use super::renders::json_response;
use crate::AppState;
use crate::metrics;
use crate::problem::Problem;
use crate::wire::{Alive, Ready};
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

/// Whether the process lives
#[utoipa::path(get, path = "/healthz", tag = "health", responses((status = OK, body = Alive)))]
pub(super) async fn live() -> Response {
    json_response(StatusCode::OK, &Alive { alive: true, version: env!("CARGO_PKG_VERSION").into() })
}

/// Whether the service takes jobs: not while it stops, and not without its database
#[utoipa::path(get, path = "/readyz", tag = "health", responses((status = OK, body = Ready), (status = 503)))]
pub(super) async fn ready(State(app): State<AppState>) -> Result<Response, Problem> {
    if app.jobs.is_draining() {
        return Err(Problem::draining());
    }
    if !app.jobs.is_healthy().await {
        return Err(Problem::unavailable());
    }
    Ok(json_response(StatusCode::OK, &Ready { ready: true }))
}

/// Numbers for Prometheus
#[utoipa::path(
    get, path = "/metrics", tag = "health",
    responses((status = OK, body = String, content_type = "application/openmetrics-text"))
)]
pub(super) async fn metrics(State(app): State<AppState>) -> Result<Response, Problem> {
    let text = app.metrics.text(app.jobs.counts().await?).map_err(Problem::internal)?;
    let head = [(header::CONTENT_TYPE, metrics::CONTENT_TYPE), (header::CACHE_CONTROL, "no-store")];
    Ok((head, text).into_response())
}
