//! Pictures of jobs: finished ones from where they are kept, unfinished ones from memory.

use super::renders::{not_modified, parse_id};
use crate::AppState;
use crate::access::Caller;
use crate::chart;
use crate::jobs::service::PreviewState;
use crate::problem::Problem;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};

const PNG: &str = "image/png";
const EXR: &str = "image/x-exr";
const SVG: &str = "image/svg+xml";

/// The finished picture, as the scene exposes and tones it
#[utoipa::path(
    get, path = "/v1/renders/{id}/image.png", tag = "pictures", security(("key" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = OK, body = Vec<u8>, content_type = "image/png"), (status = 304), (status = 404),
        (status = 409, description = "The job has no picture in its state"), (status = 410)
    )
)]
pub(super) async fn get_image_png(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    send(&app, &caller, (&id, "image.png", PNG), &headers).await
}

/// The finished picture as linear radiance (OpenEXR)
#[utoipa::path(
    get, path = "/v1/renders/{id}/image.exr", tag = "pictures", security(("key" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = OK, body = Vec<u8>, content_type = "image/x-exr"), (status = 304), (status = 404),
        (status = 409, description = "The job has no picture in its state"), (status = 410)
    )
)]
pub(super) async fn get_image_exr(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    send(&app, &caller, (&id, "image.exr", EXR), &headers).await
}

/// The estimated error of each pixel, from 0.1 % (dark) to 100 % (bright), on a logarithmic scale
#[utoipa::path(
    get, path = "/v1/renders/{id}/error.png", tag = "pictures", security(("key" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = OK, body = Vec<u8>, content_type = "image/png"), (status = 304), (status = 404),
        (status = 409, description = "The job has no picture in its state"), (status = 410)
    )
)]
pub(super) async fn get_error_map(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    send(&app, &caller, (&id, "error.png", PNG), &headers).await
}

/// A layer: the light of one class of paths, or what the scene named; `.png` as it is shown, `.exr` as linear radiance
///
/// The job's links name those that it has. The classes add up to the picture.
#[utoipa::path(
    get, path = "/v1/renders/{id}/layers/{file}", tag = "pictures", security(("key" = [])),
    params(("id" = String, Path, format = Uuid), ("file" = String, Path, example = "caustic.png")),
    responses(
        (status = OK, content((Vec<u8> = "image/png"), (Vec<u8> = "image/x-exr"))), (status = 304), (status = 404),
        (status = 409, description = "The job has no picture in its state"), (status = 410)
    )
)]
pub(super) async fn get_layer(
    State(app): State<AppState>,
    caller: Caller,
    Path((id, file)): Path<(String, String)>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let kind = if file.ends_with(".exr") { EXR } else { PNG };
    send(&app, &caller, (&id, &format!("layers/{file}"), kind), &headers).await
}

/// The picture of the rounds that are finished so far
#[utoipa::path(
    get, path = "/v1/renders/{id}/preview.png", tag = "pictures", security(("key" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses(
        (status = OK, body = Vec<u8>, content_type = "image/png"), (status = 404),
        (status = 409, description = "No round is finished"), (status = 410)
    )
)]
pub(super) async fn get_preview(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let bytes = match app.jobs.preview(&caller.0, parse_id(&id)?).await? {
        PreviewState::Ready(png) => png.to_vec(),
        PreviewState::Final(png) => png,
        PreviewState::Nothing(state) => return Err(Problem::no_picture(state)),
    };
    let head = [(header::CONTENT_TYPE, PNG), (header::CACHE_CONTROL, "no-store")];
    Ok((head, bytes).into_response())
}

/// The estimated error against time, so far
#[utoipa::path(
    get, path = "/v1/renders/{id}/chart.svg", tag = "pictures", security(("key" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses((status = OK, body = String, content_type = "image/svg+xml"), (status = 404), (status = 410))
)]
pub(super) async fn get_chart(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let (name, history) = app.jobs.history(&caller.0, parse_id(&id)?).await?;
    let head = [(header::CONTENT_TYPE, SVG), (header::CACHE_CONTROL, "no-store")];
    Ok((head, chart::draw(&name, &history)).into_response())
}

async fn send(
    app: &AppState,
    caller: &Caller,
    (id, name, kind): (&str, &str, &'static str),
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let id = parse_id(id)?;
    let artifact = match app.jobs.artifact(&caller.0, id, name).await? {
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
    if known.status() == StatusCode::NOT_MODIFIED {
        return Ok(known);
    }
    Ok((head, app.jobs.artifact_bytes(id, artifact).await?).into_response())
}
