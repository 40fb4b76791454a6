//! What went wrong, as `application/problem+json` (RFC 9457): the only place with error status codes.

use crate::engine::Issue;
use crate::jobs::{JobState, StoreError};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value, json};
use std::fmt::Display;

/// Seconds after which a full queue is worth another try.
const QUEUE_RETRY_S: u32 = 5;

/// The code of a problem, left in the answer for whoever counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProblemCode(pub(crate) &'static str);

/// An error as the client reads it. Internal text goes to the log, never in here.
#[derive(Debug)]
pub struct Problem {
    status: StatusCode,
    code: &'static str,
    title: &'static str,
    detail: String,
    retry_after_s: Option<u32>,
    members: Map<String, Value>,
}

impl Problem {
    fn new(status: StatusCode, code: &'static str, title: &'static str, detail: impl Into<String>) -> Self {
        Self { status, code, title, detail: detail.into(), retry_after_s: None, members: Map::new() }
    }

    fn with(mut self, member: &str, value: impl Into<Value>) -> Self {
        self.members.insert(member.into(), value.into());
        self
    }

    #[cfg(test)]
    pub(crate) fn code(&self) -> &'static str {
        self.code
    }

    pub(crate) fn retry_after(mut self, seconds: u32) -> Self {
        self.retry_after_s = Some(seconds);
        self
    }

    /// 400: something of the request other than its body is wrong.
    pub fn bad_request(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::BAD_REQUEST, "bad_request", "The request is malformed", detail)
    }

    /// 400: the body is not text.
    #[must_use]
    pub fn not_utf8(byte: usize) -> Self {
        let detail = format!("The body must be JSON in UTF-8; byte {byte} is neither.");
        Self::new(StatusCode::BAD_REQUEST, "not_utf8", "The body is not UTF-8", detail)
    }

    /// 401: a key is needed, or this one is none.
    pub fn unauthorized(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNAUTHORIZED, "unauthorized", "An API key is needed", detail)
    }

    /// 404: there is nothing here.
    pub fn not_found(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, "not_found", "Not found", detail)
    }

    /// 405: there is something here, but not for this method.
    #[must_use]
    pub fn method_not_allowed() -> Self {
        let detail = "This address does not take this method; the Allow header lists those it takes.";
        Self::new(StatusCode::METHOD_NOT_ALLOWED, "method_not_allowed", "Method not allowed", detail)
    }

    /// 408: the body did not arrive in time.
    #[must_use]
    pub fn body_too_slow() -> Self {
        let detail = "The body did not arrive in time.";
        Self::new(StatusCode::REQUEST_TIMEOUT, "body_too_slow", "The body took too long", detail)
    }

    /// 409: the job has no picture in this state.
    #[must_use]
    pub fn no_picture(state: JobState) -> Self {
        let detail = format!("The job is {}; it has no such picture.", state.as_str());
        let problem = Self::new(StatusCode::CONFLICT, "no_picture", "The picture is not there", detail)
            .with("state", state.as_str())
            .with("done", state.is_done());
        if state.is_done() { problem } else { problem.retry_after(1) }
    }

    /// 410: there was a job, and its time is over.
    #[must_use]
    pub fn expired() -> Self {
        let detail = "The job was done, was kept as long as this service keeps jobs, and is forgotten now.";
        Self::new(StatusCode::GONE, "expired", "The job has expired", detail)
    }

    /// 413: the body is larger than the service takes.
    #[must_use]
    pub fn body_too_large(limit: usize) -> Self {
        let detail = format!("The body is larger than the {limit} bytes that this service takes.");
        Self::new(StatusCode::PAYLOAD_TOO_LARGE, "body_too_large", "The body is too large", detail)
            .with("limit", limit)
    }

    /// 415: the body is not declared as JSON.
    #[must_use]
    pub fn not_json_type() -> Self {
        let detail = "Send the scene with the header \"Content-Type: application/json\".";
        Self::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "not_json", "The body is not declared as JSON", detail)
    }

    /// 422 (400 if it is not even JSON): the scene cannot be rendered, and these are all the reasons.
    #[must_use]
    pub fn bad_scene(issues: &[Issue]) -> Self {
        let detail = match issues {
            [only] => only.detail.clone(),
            several => format!("There are {} errors in the scene.", several.len()),
        };
        let errors: Vec<_> = issues.iter().map(issue_json).collect();
        let problem = if issues.iter().any(|issue| issue.code == "syntax") {
            Self::new(StatusCode::BAD_REQUEST, "json_invalid", "The body is not JSON", detail)
        } else {
            let title = "The scene cannot be rendered";
            Self::new(StatusCode::UNPROCESSABLE_ENTITY, "scene_invalid", title, detail)
        };
        problem.with("errors", errors)
    }

    /// 422: the scene asks for more than one job may have.
    #[must_use]
    pub fn over_limit(pointer: &str, asked: Value, limit: Value, what: &str) -> Self {
        let detail = format!("The scene asks for {asked} {what}; the limit of this service is {limit}.");
        let error = json!({ "pointer": pointer, "code": "limit_exceeded", "detail": detail });
        let title = "The scene asks for too much";
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, "limit_exceeded", title, detail)
            .with("limit", limit)
            .with("errors", vec![error])
    }

    /// 422: an asset's content is another than its name.
    #[must_use]
    pub fn asset_mismatch(actual: &str) -> Self {
        let detail = format!("The SHA-256 of what came is {actual}.");
        let title = "The content is not what its name says";
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, "asset_mismatch", title, detail).with("sha256", actual)
    }

    /// 429: too many requests in too short a time.
    #[must_use]
    pub fn rate_limited(seconds: u32, limit: u32) -> Self {
        let detail = format!("More than {limit} requests per second came; try again in {seconds} s.");
        Self::new(StatusCode::TOO_MANY_REQUESTS, "rate_limited", "Too many requests", detail)
            .with("limit", limit)
            .retry_after(seconds)
    }

    /// 503: the service is about to stop.
    #[must_use]
    pub fn draining() -> Self {
        let detail = "The service is stopping and takes no new jobs.";
        Self::new(StatusCode::SERVICE_UNAVAILABLE, "draining", "The service is stopping", detail)
            .retry_after(QUEUE_RETRY_S)
    }

    /// 503: too much is on its way in.
    #[must_use]
    pub fn busy() -> Self {
        let detail = "Too much is being sent at once; try again soon.";
        Self::new(StatusCode::SERVICE_UNAVAILABLE, "busy", "The service has no room for it now", detail)
            .retry_after(QUEUE_RETRY_S)
    }

    /// 503: the service cannot do its work now.
    #[must_use]
    pub fn unavailable() -> Self {
        let detail = "The service cannot use its database.";
        Self::new(StatusCode::SERVICE_UNAVAILABLE, "unavailable", "The service is not available", detail)
            .retry_after(QUEUE_RETRY_S)
    }

    /// 500, with the reason in the log alone.
    pub fn internal(reason: impl Display) -> Self {
        tracing::error!(%reason, "a request failed");
        let detail = "The service failed; its log says how.";
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, "internal", "Internal error", detail)
    }
}

fn issue_json(issue: &Issue) -> Value {
    let mut error = json!({ "pointer": issue.pointer, "code": issue.code, "detail": issue.detail });
    if let Some([line, column]) = issue.place {
        error["line"] = line.into();
        error["column"] = column.into();
    }
    error
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::NotFound => Self::not_found("There is no job of this name."),
            StoreError::Expired => Self::expired(),
            StoreError::TooManyJobs(limit) => Self::new(
                StatusCode::TOO_MANY_REQUESTS,
                "too_many_jobs",
                "Too many unfinished jobs",
                format!("{limit} jobs of this key are unfinished; wait for one, or cancel one."),
            )
            .retry_after(QUEUE_RETRY_S)
            .with("limit", limit),
            StoreError::StorageFull => Self::new(
                StatusCode::INSUFFICIENT_STORAGE,
                "storage_full",
                "The disk is full",
                "The service has no room for more; what it has is kept and can be fetched.",
            )
            .retry_after(30),
            StoreError::QueueFull(waiting) => Self::new(
                StatusCode::TOO_MANY_REQUESTS,
                "queue_full",
                "The queue is full",
                format!("{waiting} jobs wait already; try again later."),
            )
            .retry_after(QUEUE_RETRY_S)
            .with("limit", waiting),
            StoreError::KeyReused => Self::new(
                StatusCode::UNPROCESSABLE_ENTITY,
                "idempotency_key_reused",
                "The idempotency key belongs to another request",
                "This Idempotency-Key came with another body before; use a new one.",
            ),
            error @ (StoreError::IllegalMove(_)
            | StoreError::StaleAttempt
            | StoreError::NotCommitted
            | StoreError::Newer
            | StoreError::Sqlite(_)) => Self::internal(error),
        }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut body = json!({
            "type": format!("urn:nephroid:problem:{}", self.code),
            "title": self.title,
            "status": self.status.as_u16(),
            "detail": self.detail,
            "code": self.code,
        });
        if let Some(seconds) = self.retry_after_s {
            body["retry_after"] = seconds.into();
        }
        if let Value::Object(members) = &mut body {
            members.extend(self.members);
        }
        let kind = [(header::CONTENT_TYPE, "application/problem+json"), (header::CACHE_CONTROL, "no-store")];
        let mut response = (self.status, kind, body.to_string()).into_response();
        if let Some(seconds) = self.retry_after_s {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        if self.status == StatusCode::UNAUTHORIZED {
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response.extensions_mut().insert(ProblemCode(self.code));
        response
    }
}
