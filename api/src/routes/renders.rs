//! `/v1/renders`: submit, list, look, cancel, delete.

use crate::AppState;
use crate::body::read_json_text;
use crate::jobs::service::{Status, Submission};
use crate::jobs::{JobId, Page};
use crate::problem::Problem;
use crate::wire::{CreateQuery, JobList, JobView, ListQuery, job_path};
use axum::body::Body;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use sha2::{Digest, Sha256};
use std::time::Duration;

const PREFER: HeaderName = HeaderName::from_static("prefer");
const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");
const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");
const IDEMPOTENT_REPLAYED: HeaderName = HeaderName::from_static("idempotent-replayed");

/// Longest time that `Prefer: wait` holds an answer: shorter than what gateways cut off.
const MAX_WAIT_S: u64 = 30;
const DEFAULT_PAGE: u32 = 20;
const MAX_PAGE: u32 = 100;
const MAX_KEY_LENGTH: usize = 255;

/// `POST /v1/renders`
pub(super) async fn create_render(
    State(app): State<AppState>,
    query: Result<Query<CreateQuery>, QueryRejection>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|error| Problem::bad_request(error.body_text()))?;
    if app.jobs.is_draining() {
        return Err(Problem::draining());
    }
    let idempotency_key = idempotency_key(&headers)?;
    let text = read_json_text(&headers, body, app.settings.max_body).await?;
    if query.validate_only {
        let plan = app.planner.plan(text).await?.report();
        return Ok(json_response(StatusCode::OK, &serde_json::json!({ "valid": true, "plan": plan })));
    }
    let (text, scene) = app.planner.read(text).await?;
    let (id, replayed) = app.jobs.submit(Submission { text, scene, idempotency_key }).await?;
    let wait = preferred_wait(&headers);
    let status = match wait {
        Some(wait) => app.jobs.status_within(id, wait).await?,
        None => app.jobs.status(id).await?,
    };
    let mut response = answer_created(id, status);
    if let Some(applied) = wait.and_then(|wait| format!("wait={}", wait.as_secs()).parse().ok()) {
        response.headers_mut().insert(PREFERENCE_APPLIED, applied);
    }
    if replayed {
        response.headers_mut().insert(IDEMPOTENT_REPLAYED, HeaderValue::from_static("true"));
    }
    Ok(response)
}

/// `GET /v1/renders`
pub(super) async fn list_renders(
    State(app): State<AppState>,
    query: Result<Query<ListQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|error| Problem::bad_request(error.body_text()))?;
    let limit = query.limit.unwrap_or(DEFAULT_PAGE);
    if !(1..=MAX_PAGE).contains(&limit) {
        return Err(Problem::bad_request(format!("`limit` must be from 1 to {MAX_PAGE}.")));
    }
    let before = query.cursor.as_deref().map(read_cursor).transpose()?;
    // One more than asked for tells whether there is another page.
    let page = Page { state: query.state, before, limit: limit + 1 };
    let mut jobs = app.jobs.list(page).await?;
    let more = jobs.len() > limit as usize;
    jobs.truncate(limit as usize);
    let next_cursor = jobs.last().filter(|_| more).map(|last| format!("{:x}", last.job.seq));
    let list = JobList { renders: jobs.into_iter().map(JobView::brief).collect(), next_cursor };
    Ok(json_response(StatusCode::OK, &list))
}

/// `GET /v1/renders/{id}`
pub(super) async fn get_render(
    State(app): State<AppState>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let status = app.jobs.status(parse_id(&id)?).await?;
    let retry_after = retry_after_s(&status);
    let mut response = json_response(StatusCode::OK, &JobView::full(status));
    if let Some(seconds) = retry_after {
        response.headers_mut().insert(header::RETRY_AFTER, seconds.into());
    }
    Ok(not_modified(&headers, response))
}

/// `GET /v1/renders/{id}/scene.json`
pub(super) async fn get_render_scene(
    State(app): State<AppState>,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let scene = app.jobs.scene(parse_id(&id)?).await?;
    Ok(([(header::CONTENT_TYPE, "application/json")], scene).into_response())
}

/// `POST /v1/renders/{id}/cancel`
pub(super) async fn cancel_render(
    State(app): State<AppState>,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let id = parse_id(&id)?;
    app.jobs.cancel(id).await?;
    Ok(json_response(StatusCode::OK, &JobView::full(app.jobs.status(id).await?)))
}

/// `DELETE /v1/renders/{id}`
pub(super) async fn delete_render(
    State(app): State<AppState>,
    Path(id): Path<String>,
) -> Result<StatusCode, Problem> {
    app.jobs.delete(parse_id(&id)?).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// The id in an address; one that is not an id belongs to no job.
pub(super) fn parse_id(text: &str) -> Result<JobId, Problem> {
    text.parse().map_err(|_| Problem::not_found("There is no job of this name."))
}

/// JSON with a strong `ETag`, not to be used again without asking.
pub(super) fn json_response(status: StatusCode, body: &impl serde::Serialize) -> Response {
    let Ok(body) = serde_json::to_string(body) else {
        return Problem::internal("an answer could not be written as JSON").into_response();
    };
    let digest = Sha256::digest(body.as_bytes());
    let tag: String = digest.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    let head = [
        (header::CONTENT_TYPE, "application/json".to_owned()),
        (header::CACHE_CONTROL, "no-cache".to_owned()),
        (header::ETAG, format!("\"{tag}\"")),
    ];
    (status, head, body).into_response()
}

/// The answer, or 304 if the client has it already.
pub(super) fn not_modified(request: &HeaderMap, mut response: Response) -> Response {
    let tags = request.get_all(header::IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok());
    let own = response.headers().get(header::ETAG).and_then(|value| value.to_str().ok());
    let known = tags.flat_map(|list| list.split(',')).map(str::trim);
    if own.is_some_and(|own| known.into_iter().any(|tag| tag == "*" || tag.trim_start_matches("W/") == own)) {
        *response.status_mut() = StatusCode::NOT_MODIFIED;
        *response.body_mut() = Body::empty();
        response.headers_mut().remove(header::CONTENT_TYPE);
        response.headers_mut().remove(header::CONTENT_LENGTH);
    }
    response
}

/// 200 if the job is done already, else 202; either way with the job's address.
fn answer_created(id: JobId, status: Status) -> Response {
    let retry_after = retry_after_s(&status);
    let code = if retry_after.is_some() { StatusCode::ACCEPTED } else { StatusCode::OK };
    let mut response = json_response(code, &JobView::full(status));
    if let Ok(location) = job_path(id).parse() {
        response.headers_mut().insert(header::LOCATION, location);
    }
    if let Some(seconds) = retry_after {
        response.headers_mut().insert(header::RETRY_AFTER, seconds.into());
    }
    response
}

/// When to look again; `None` once the job is done.
fn retry_after_s(status: &Status) -> Option<u32> {
    let waiting_before = status.queue_position.unwrap_or(0);
    (!status.job.state.is_done()).then(|| (1 + waiting_before / 4).min(30))
}

fn preferred_wait(headers: &HeaderMap) -> Option<Duration> {
    let values = headers.get_all(PREFER).iter().filter_map(|value| value.to_str().ok());
    let preferences = values.flat_map(|value| value.split([',', ';'])).map(str::trim);
    let seconds = preferences.filter_map(|preference| {
        let (name, value) = preference.split_once('=')?;
        name.trim()
            .eq_ignore_ascii_case("wait")
            .then(|| value.trim().trim_matches('"').parse::<u64>().ok())?
    });
    // The first of several counts (RFC 7240, section 2).
    seconds.into_iter().next().map(|seconds| Duration::from_secs(seconds.min(MAX_WAIT_S)))
}

fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let Some(value) = headers.get(IDEMPOTENCY_KEY) else { return Ok(None) };
    let key = value.to_str().unwrap_or_default();
    if key.is_empty() || key.len() > MAX_KEY_LENGTH {
        let detail = format!("`Idempotency-Key` must have 1 to {MAX_KEY_LENGTH} visible ASCII characters.");
        return Err(Problem::bad_request(detail));
    }
    Ok(Some(key.to_owned()))
}

fn read_cursor(text: &str) -> Result<i64, Problem> {
    i64::from_str_radix(text, 16).map_err(|_| Problem::bad_request("`cursor` is not one that a list gave."))
}
