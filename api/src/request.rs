//! What happens to every request: a name, a line in the log, a number, headers that protect, answers to panics.

use crate::AppState;
use crate::config::Settings;
use crate::problem::{Problem, ProblemCode};
use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderName, HeaderValue, Method, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::any::Any;
use std::time::{Duration, Instant};
use tower_http::cors::CorsLayer;
use tracing::Instrument;

const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
/// Longest name that a client may give a request.
const MAX_ID: usize = 64;
/// Browsers ask again whether another origin may come after this time.
const PREFLIGHT_AGE: Duration = Duration::from_secs(3600);

/// Names, logs and counts a request.
pub(crate) async fn observe(State(app): State<AppState>, request: Request, next: Next) -> Response {
    let start = Instant::now();
    let id = request_id(&request);
    let method = request.method().clone();
    let span = tracing::info_span!("request", id, %method, path = request.uri().path());
    let route = request.extensions().get::<MatchedPath>().cloned();
    let mut response = next.run(request).instrument(span.clone()).await;
    let (status, took) = (response.status().as_u16(), start.elapsed());
    let code = response.extensions().get::<ProblemCode>().map(|code| code.0);
    span.in_scope(|| tracing::debug!(status, code, ?took, "answered"));
    let route = route.as_ref().map_or("(none)", MatchedPath::as_str);
    let method = if is_known(&method) { method.as_str() } else { "(other)" };
    app.metrics.answered([method, route], status, took);
    if let Some(code) = code {
        app.metrics.refused(code);
    }
    if let Ok(id) = HeaderValue::try_from(id) {
        response.headers_mut().insert(REQUEST_ID, id);
    }
    response
}

/// The client's own name for the request, if it is harmless, or a new one.
fn request_id(request: &Request) -> String {
    let given = request.headers().get(REQUEST_ID).and_then(|value| value.to_str().ok());
    let harmless = |id: &&str| {
        (1..=MAX_ID).contains(&id.len())
            && id.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_.".contains(&b))
    };
    given.filter(harmless).map_or_else(|| uuid::Uuid::now_v7().simple().to_string(), str::to_owned)
}

/// Methods that a client makes up must not make up series of metrics.
fn is_known(method: &Method) -> bool {
    [Method::GET, Method::HEAD, Method::POST, Method::PUT, Method::DELETE, Method::OPTIONS].contains(method)
}

/// Headers that every answer carries: browsers guess no types and run nothing but the page's own files.
pub(crate) async fn harden(request: Request, next: Next) -> Response {
    const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
        connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    response
}

/// What pages of the configured origins may send and see. They come with a key in a header, never with the cookie.
pub(crate) fn cors(settings: &Settings) -> CorsLayer {
    let own =
        |names: &[&'static str]| names.iter().map(|name| HeaderName::from_static(name)).collect::<Vec<_>>();
    CorsLayer::new()
        .allow_origin(settings.cors_origin.clone())
        .allow_methods([Method::GET, Method::POST, Method::PUT, Method::DELETE])
        .allow_headers(own(&[
            "authorization",
            "content-type",
            "idempotency-key",
            "if-none-match",
            "last-event-id",
            "prefer",
            "x-request-id",
        ]))
        .expose_headers(own(&[
            "location",
            "retry-after",
            "etag",
            "preference-applied",
            "idempotent-replayed",
            "x-request-id",
        ]))
        .max_age(PREFLIGHT_AGE)
}

/// A panic of a handler, as its client sees it.
pub(crate) fn answer_panic(panic: Box<dyn Any + Send>) -> Response {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    Problem::internal(text.unwrap_or("panic without text")).into_response()
}
