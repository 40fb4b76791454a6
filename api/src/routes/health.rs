//! `/healthz` and `/readyz`: whether the process lives, and whether it takes jobs.

use super::renders::json_response;
use crate::AppState;
use crate::problem::Problem;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use serde_json::json;

/// `GET /healthz`
pub(super) async fn live() -> Response {
    json_response(StatusCode::OK, &json!({ "alive": true, "version": env!("CARGO_PKG_VERSION") }))
}

/// `GET /readyz`
pub(super) async fn ready(State(app): State<AppState>) -> Result<Response, Problem> {
    if app.jobs.is_draining() {
        return Err(Problem::draining());
    }
    if !app.jobs.is_healthy().await {
        return Err(Problem::unavailable());
    }
    Ok(json_response(StatusCode::OK, &json!({ "ready": true })))
}
