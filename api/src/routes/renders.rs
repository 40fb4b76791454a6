//! `/v1/renders`: submit, list, look, cancel, delete.

use crate::AppState;
use crate::access::Caller;
use crate::body::read_json_text;
use crate::jobs::service::{Accepted, Status, Submission};
use crate::jobs::{Answer, JobId, Page, StoreError};
use crate::problem::Problem;
use crate::wire::{CreateQuery, JobList, JobView, ListQuery, Validated, job_path};
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
const MAX_LABEL: usize = 200;
/// Longest time, in seconds, after which a job may be told to end: a week.
const MAX_CANCEL_AFTER: u32 = 604_800;

/// Submit a scene
///
/// The answer comes once the job is on disk; from then on it survives crashes.
#[utoipa::path(
    post, path = "/v1/renders", tag = "renders", security(("key" = [])),
    params(
        CreateQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=n`: hold the answer up to n seconds, at most 30", example = "wait=10"),
        ("Idempotency-Key" = Option<String>, Header, max_length = 255, description = "The same key with the same scene gives the first job again")
    ),
    request_body(content = crate::openapi::Scene, content_type = "application/json"),
    responses(
        (status = ACCEPTED, description = "The job waits or runs", body = JobView, headers(
            ("Location" = String, description = "Address of the job"),
            ("Retry-After" = u32, description = "Seconds after which to look again"),
            ("Idempotent-Replayed" = Option<String>, description = "`true` if the job was there"))),
        (status = OK, description = "The job is done, or the scene was only validated", body = Submitted),
        (status = 400), (status = 408), (status = 413), (status = 415), (status = 422), (status = 507)
    )
)]
pub(super) async fn create_render(
    State(app): State<AppState>,
    caller: Caller,
    query: Result<Query<CreateQuery>, QueryRejection>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|error| Problem::bad_request(error.body_text()))?;
    if app.jobs.is_draining() {
        return Err(Problem::draining());
    }
    if query.label.as_ref().is_some_and(|label| label.chars().count() > MAX_LABEL) {
        return Err(Problem::bad_request(format!("`label` must have at most {MAX_LABEL} characters.")));
    }
    if query.cancel_after.is_some_and(|seconds| !(1..=MAX_CANCEL_AFTER).contains(&seconds)) {
        return Err(Problem::bad_request(format!(
            "`cancel_after` must be from 1 to {MAX_CANCEL_AFTER} seconds."
        )));
    }
    let idempotency_key = idempotency_key(&headers)?;
    let (text, taken) = read_json_text(&headers, body, &app.room).await?;
    let assets = app.jobs.assets_of(caller.0.clone());
    if query.validate_only {
        let plan = app.planner.plan(text, assets).await?.report();
        return Ok(json_response(StatusCode::OK, &Validated { valid: true, plan }));
    }
    let (text, scene) = app.planner.read(text, assets).await?;
    let owner = caller.0.clone();
    let cancel_after = query.cancel_after.map(|seconds| Duration::from_secs(seconds.into()));
    let submission = Submission { text, scene, owner, label: query.label, cancel_after, idempotency_key };
    let Accepted { mut status, replayed } =
        app.jobs.submit(submission).await.map_err(|error| refusal(&app, error))?;
    drop(taken);
    let id = status.job.id;
    tracing::info!(job = %id, replayed, "accepted");
    if !replayed {
        app.metrics.job("accepted");
    }
    let wait = preferred_wait(&headers);
    if let Some(wait) = wait {
        status = app.jobs.status_within(&caller.0, id, wait).await?;
    }
    let mut response = answer_created(id, status);
    if let Some(applied) = wait.and_then(|wait| format!("wait={}", wait.as_secs()).parse().ok()) {
        response.headers_mut().insert(PREFERENCE_APPLIED, applied);
    }
    if replayed {
        response.headers_mut().insert(IDEMPOTENT_REPLAYED, HeaderValue::from_static("true"));
    }
    Ok(response)
}

/// What a submission that is answered with 200 gives.
#[derive(utoipa::ToSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "it only describes answers")]
enum Submitted {
    Done(Box<JobView>),
    Validated(Validated),
}

/// List jobs, newest first
#[utoipa::path(
    get, path = "/v1/renders", tag = "renders", security(("key" = [])), params(ListQuery),
    responses((status = OK, body = JobList), (status = 400))
)]
pub(super) async fn list_renders(
    State(app): State<AppState>,
    caller: Caller,
    query: Result<Query<ListQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|error| Problem::bad_request(error.body_text()))?;
    let limit = query.limit.unwrap_or(DEFAULT_PAGE);
    if !(1..=MAX_PAGE).contains(&limit) {
        return Err(Problem::bad_request(format!("`limit` must be from 1 to {MAX_PAGE}.")));
    }
    let before = query.cursor.as_deref().map(read_cursor).transpose()?;
    // One more than asked for tells whether there is another page.
    let page = Page { owner: caller.0, label: query.label, state: query.state, before, limit: limit + 1 };
    let mut jobs = app.jobs.list(page).await?;
    let more = jobs.len() > limit as usize;
    jobs.truncate(limit as usize);
    let next_cursor = jobs.last().filter(|_| more).map(|last| format!("{:x}", last.job.seq));
    let list = JobList { renders: jobs.into_iter().map(JobView::brief).collect(), next_cursor };
    Ok(json_response(StatusCode::OK, &list))
}

/// A job as it is now
#[utoipa::path(
    get, path = "/v1/renders/{id}", tag = "renders", security(("key" = [])),
    params(("id" = String, Path, format = Uuid), ("If-None-Match" = Option<String>, Header)),
    responses(
        (status = OK, body = JobView, headers(
            ("ETag" = String), ("Retry-After" = Option<u32>, description = "While the job is not done"))),
        (status = 304), (status = 404), (status = 410)
    )
)]
pub(super) async fn get_render(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let answer = app.jobs.answer(&caller.0, parse_id(&id)?, write_answer).await?;
    let head = [
        (header::CONTENT_TYPE, "application/json"),
        (header::CACHE_CONTROL, "no-cache"),
        (header::ETAG, answer.etag.as_str()),
    ];
    let mut response = (head, answer.body.clone()).into_response();
    if let Some(seconds) = answer.retry_after_s {
        response.headers_mut().insert(header::RETRY_AFTER, seconds.into());
    }
    Ok(not_modified(&headers, response))
}

fn write_answer(status: Status) -> Answer {
    let retry_after_s = retry_after_s(&status);
    // A job has nothing in it that JSON cannot hold.
    let body = serde_json::to_vec(&JobView::full(status)).unwrap_or_default();
    Answer { etag: etag_of(&body), body: body.into(), retry_after_s }
}

/// The scene of a job, as it was sent
#[utoipa::path(
    get, path = "/v1/renders/{id}/scene.json", tag = "renders", security(("key" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses((status = OK, body = crate::openapi::Scene), (status = 404), (status = 410))
)]
pub(super) async fn get_render_scene(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let scene = app.jobs.scene(&caller.0, parse_id(&id)?).await?;
    Ok(([(header::CONTENT_TYPE, "application/json")], scene).into_response())
}

/// Stop a job; harmless if it is done
#[utoipa::path(
    post, path = "/v1/renders/{id}/cancel", tag = "renders", security(("key" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses((status = OK, body = JobView), (status = 404), (status = 410))
)]
pub(super) async fn cancel_render(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<Response, Problem> {
    let id = parse_id(&id)?;
    if app.jobs.cancel(&caller.0, id).await? {
        tracing::info!(job = %id, "cancelled");
        app.metrics.job("cancelled");
    }
    Ok(json_response(StatusCode::OK, &JobView::full(app.jobs.status(&caller.0, id).await?)))
}

/// Stop a job and forget it with its pictures
#[utoipa::path(
    delete, path = "/v1/renders/{id}", tag = "renders", security(("key" = [])),
    params(("id" = String, Path, format = Uuid)),
    responses((status = NO_CONTENT), (status = 404), (status = 410))
)]
pub(super) async fn delete_render(
    State(app): State<AppState>,
    caller: Caller,
    Path(id): Path<String>,
) -> Result<StatusCode, Problem> {
    let id = parse_id(&id)?;
    app.jobs.delete(&caller.0, id).await?;
    tracing::info!(job = %id, "deleted");
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
    let etag = etag_of(body.as_bytes());
    let head = [
        (header::CONTENT_TYPE, "application/json".to_owned()),
        (header::CACHE_CONTROL, "no-cache".to_owned()),
        (header::ETAG, etag),
    ];
    (status, head, body).into_response()
}

fn etag_of(body: &[u8]) -> String {
    let digest = Sha256::digest(body);
    let tag: String = digest.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    format!("\"{tag}\"")
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

/// When to look again; `None` once the job is done. A job is asked for when a good part of what is left should have been
/// made: of one that runs by the speed at which it has advanced, of one that waits by what jobs before it took.
fn retry_after_s(status: &Status) -> Option<u32> {
    if status.job.state.is_done() {
        return None;
    }
    let Some(progress) = status.progress else {
        let before_its_end = f64::from(status.queue_position.unwrap_or(0)) + 1.0;
        return Some(whole_seconds(before_its_end * status.seconds_per_job / 4.0));
    };
    let fraction = f64::from(progress.fraction);
    let left = if fraction > 0.0 { progress.seconds * (1.0 - fraction) / fraction } else { 1.0 };
    Some(whole_seconds(left / 4.0))
}

/// Why a job was not taken. A place in a full queue is free again when about one job has ended.
fn refusal(app: &AppState, error: StoreError) -> Problem {
    match error {
        StoreError::QueueFull(_) => {
            Problem::from(error).retry_after(whole_seconds(app.jobs.seconds_per_job()))
        }
        error => Problem::from(error),
    }
}

/// A time as clients are told it: never at once, never out of sight.
fn whole_seconds(seconds: f64) -> u32 {
    seconds.ceil().clamp(1.0, 30.0) as u32
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
