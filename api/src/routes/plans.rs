//! `/v1/plans`: what would be run for a scene, and why.

use super::renders::json_response;
use crate::AppState;
use crate::body::read_json_text;
use crate::problem::Problem;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;

/// `POST /v1/plans`
pub(super) async fn create_plan(
    State(app): State<AppState>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let text = read_json_text(&headers, body, app.settings.max_body).await?;
    Ok(json_response(StatusCode::OK, &app.planner.plan(text).await?.report()))
}
