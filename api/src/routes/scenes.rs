//! `/v1/scenes`: the sample scenes. `/v1/schema`: what a scene may hold.

use super::renders::{json_response, not_modified};
use crate::engine;
use crate::problem::Problem;
use crate::samples;
use crate::wire::{SampleList, SampleView};
use axum::extract::Path;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

/// The sample scenes
#[utoipa::path(get, path = "/v1/scenes", tag = "scenes", responses((status = OK, body = SampleList)))]
pub(super) async fn list_scenes() -> Response {
    let view = |sample: samples::Sample| SampleView {
        name: sample.name.into(),
        title: sample.title(),
        href: format!("/v1/scenes/{}", sample.name),
        picture: sample.picture().map(|_| format!("/v1/scenes/{}/picture.png", sample.name)),
    };
    json_response(StatusCode::OK, &SampleList { scenes: samples::all().map(view).collect() })
}

/// A sample scene
#[utoipa::path(
    get, path = "/v1/scenes/{name}", tag = "scenes", params(("name" = String, Path)),
    responses((status = OK, body = crate::openapi::Scene), (status = 404))
)]
pub(super) async fn get_scene(Path(name): Path<String>) -> Result<Response, Problem> {
    let sample = samples::find(name.trim_end_matches(".json")).ok_or_else(unknown)?;
    Ok(([(header::CONTENT_TYPE, "application/json")], sample.text).into_response())
}

/// What a sample scene looks like
#[utoipa::path(
    get, path = "/v1/scenes/{name}/picture.png", tag = "scenes", params(("name" = String, Path)),
    responses((status = OK, body = Vec<u8>, content_type = "image/png"), (status = 404))
)]
pub(super) async fn get_scene_picture(Path(name): Path<String>) -> Result<Response, Problem> {
    let picture = samples::find(&name).and_then(|sample| sample.picture()).ok_or_else(unknown)?;
    let head = [(header::CONTENT_TYPE, "image/png"), (header::CACHE_CONTROL, "max-age=3600")];
    Ok((head, picture).into_response())
}

/// What a scene may hold, as JSON Schema (draft 2020-12)
#[utoipa::path(
    get, path = "/v1/schema", tag = "scenes",
    responses((status = OK, body = Object, content_type = "application/schema+json"), (status = 304))
)]
pub(super) async fn get_schema(headers: HeaderMap) -> Response {
    let mut response = json_response(StatusCode::OK, &engine::scene_schema());
    let kind = HeaderValue::from_static("application/schema+json");
    response.headers_mut().insert(header::CONTENT_TYPE, kind);
    not_modified(&headers, response)
}

fn unknown() -> Problem {
    Problem::not_found("There is no sample scene of this name.")
}
