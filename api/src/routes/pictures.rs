//! Pictures of jobs: finished ones from their files, unfinished ones from memory.

use super::renders::{not_modified, parse_id};
use crate::AppState;
use crate::jobs::service::PreviewState;
use crate::problem::Problem;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use std::path::PathBuf;

const PNG: &str = "image/png";
const EXR: &str = "image/x-exr";

/// `GET /v1/renders/{id}/image.png`
pub(super) async fn get_image_png(
    State(app): State<AppState>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    send(&app, (&id, "image.png", PNG), &headers).await
}

/// `GET /v1/renders/{id}/image.exr`
pub(super) async fn get_image_exr(
    State(app): State<AppState>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    send(&app, (&id, "image.exr", EXR), &headers).await
}

/// `GET /v1/renders/{id}/layers/{class}.png`
pub(super) async fn get_layer(
    State(app): State<AppState>,
    Path((id, file)): Path<(String, String)>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    send(&app, (&id, &format!("layers/{file}"), PNG), &headers).await
}

/// `GET /v1/renders/{id}/preview.png`
pub(super) async fn get_preview(
    State(app): State<AppState>,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let bytes = match app.jobs.preview(parse_id(&id)?).await? {
        PreviewState::Ready(png) => png.to_vec(),
        PreviewState::Final(path) => read(path).await?,
        PreviewState::Nothing(state) => return Err(Problem::no_picture(state)),
    };
    let head = [(header::CONTENT_TYPE, PNG), (header::CACHE_CONTROL, "no-store")];
    Ok((head, bytes).into_response())
}

async fn send(
    app: &AppState,
    (id, name, kind): (&str, &str, &'static str),
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let found = app.jobs.artifact(parse_id(id)?, name).await?;
    let (artifact, path) = match found {
        Ok(found) => found,
        Err(crate::jobs::JobState::Succeeded) => {
            return Err(Problem::not_found("The job has no such picture."));
        }
        Err(state) => return Err(Problem::no_picture(state)),
    };
    let head = [
        (header::CONTENT_TYPE, kind.to_owned()),
        // A finished picture never changes, but it can be deleted: ask, and be told 304.
        (header::CACHE_CONTROL, "no-cache".to_owned()),
        (header::ETAG, format!("\"{}\"", artifact.sha256)),
    ];
    let known = not_modified(headers, (head.clone(), "").into_response());
    if known.status() == axum::http::StatusCode::NOT_MODIFIED {
        return Ok(known);
    }
    Ok((head, read(path).await?).into_response())
}

async fn read(path: PathBuf) -> Result<Vec<u8>, Problem> {
    let read = tokio::task::spawn_blocking(move || std::fs::read(path)).await;
    read.map_err(Problem::internal)?.map_err(Problem::internal)
}
