//! `/v1/assets`: meshes and pictures that scenes refer to by their SHA-256.

use super::renders::json_response;
use crate::AppState;
use crate::access::Caller;
use crate::body::receive;
use crate::jobs::{StoreError, is_sha256};
use crate::problem::Problem;
use crate::wire::Asset;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};

/// Send a file that scenes may refer to; safe to repeat
///
/// A scene names it by the same 64 digits, as the `asset` of a mesh or the `image` of a texture.
#[utoipa::path(
    put, path = "/v1/assets/{sha256}", tag = "assets", security(("key" = [])),
    params(("sha256" = String, Path, pattern = "^[0-9a-f]{64}$", description = "SHA-256 of the content, in lower case")),
    request_body(content = Vec<u8>, content_type = "application/octet-stream"),
    responses(
        (status = CREATED, body = Asset), (status = OK, description = "It was there already", body = Asset),
        (status = 400), (status = 408), (status = 413), (status = 422, description = "The content is another"), (status = 507)
    )
)]
pub(super) async fn put_asset(
    State(app): State<AppState>,
    caller: Caller,
    Path(sha256): Path<String>,
    body: Body,
) -> Result<Response, Problem> {
    if !is_sha256(&sha256) {
        return Err(Problem::bad_request("An asset's name is its SHA-256: 64 digits, 0 to 9 and a to f."));
    }
    let _place = app.room.for_upload()?;
    let upload = app.jobs.begin_upload(caller.0.clone())?;
    let new = receive(body, app.settings.max_asset, upload, sha256.clone()).await?;
    let bytes = app.jobs.asset(&caller.0, sha256.clone()).await?.1;
    let status = if new { StatusCode::CREATED } else { StatusCode::OK };
    Ok(json_response(status, &Asset { sha256, bytes }))
}

/// Take back a file that was sent
#[utoipa::path(
    get, path = "/v1/assets/{sha256}", tag = "assets", security(("key" = [])),
    params(("sha256" = String, Path, pattern = "^[0-9a-f]{64}$")),
    responses((status = OK, body = Vec<u8>, content_type = "application/octet-stream"), (status = 404))
)]
pub(super) async fn get_asset(
    State(app): State<AppState>,
    caller: Caller,
    Path(sha256): Path<String>,
) -> Result<Response, Problem> {
    let missing = || Problem::not_found("There is no asset of this name.");
    if !is_sha256(&sha256) {
        return Err(missing());
    }
    let found = app.jobs.asset(&caller.0, sha256.clone()).await;
    let (path, _) = found.map_err(|error| match error {
        StoreError::NotFound => missing(),
        error => error.into(),
    })?;
    let read = tokio::task::spawn_blocking(move || std::fs::read(path)).await.map_err(Problem::internal)?;
    let head = [
        (axum::http::header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (axum::http::header::ETAG, format!("\"{sha256}\"")),
    ];
    Ok((head, read.map_err(|_| missing())?).into_response())
}
