//! `/v1/plans`: what would be run for a scene, and why.

use super::renders::json_response;
use crate::AppState;
use crate::access::Caller;
use crate::body::read_json_text;
use crate::problem::Problem;
use crate::wire::Plan;
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;

/// What would be run for a scene, what is left out, and why; nothing is kept
#[utoipa::path(
    post, path = "/v1/plans", tag = "scenes", security(("key" = [])),
    request_body(content = crate::openapi::Scene, content_type = "application/json"),
    responses(
        (status = OK, body = Plan), (status = 400), (status = 408), (status = 413), (status = 415), (status = 422)
    )
)]
pub(super) async fn create_plan(
    State(app): State<AppState>,
    caller: Caller,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let (text, _taken) = read_json_text(&headers, body, &app.room).await?;
    let planned = app.planner.plan(text, app.jobs.assets_of(caller.0)).await?;
    Ok(json_response(StatusCode::OK, &planned.report()))
}
