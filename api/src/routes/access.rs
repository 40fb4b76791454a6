//! `/v1/session`: a key in a cookie, for the web page, whose pictures and links cannot send a header.

use super::renders::json_response;
use crate::AppState;
use crate::access::{COOKIE, owner_of};
use crate::body::{Room, read_json_text};
use crate::problem::Problem;
use crate::wire::{Session, SessionRequest};
use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

/// More than a key needs.
const MAX_BODY: usize = 4096;

/// Whether this client needs a key, and whether it has one that is known
#[utoipa::path(get, path = "/v1/session", tag = "access", responses((status = OK, body = Session)))]
pub(super) async fn get_session(
    State(app): State<AppState>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let key_needed = !app.settings.open && app.jobs.has_keys().await?;
    let welcome = owner_of(&headers, &app).await.is_ok();
    Ok(json_response(StatusCode::OK, &Session { key_needed, welcome }))
}

/// Keep a key in a cookie that scripts cannot read and other sites cannot use
#[utoipa::path(
    post, path = "/v1/session", tag = "access", request_body = SessionRequest,
    responses((status = NO_CONTENT), (status = 400), (status = 401), (status = 408), (status = 413), (status = 415))
)]
pub(super) async fn create_session(
    State(app): State<AppState>,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let (text, _) = read_json_text(&headers, body, &Room::new(MAX_BODY)).await?;
    let request: SessionRequest =
        serde_json::from_str(&text).map_err(|error| Problem::bad_request(error.to_string()))?;
    if app.jobs.owner_of(&request.key).await?.is_none() {
        return Err(Problem::unauthorized("This API key is not known, or was revoked."));
    }
    // A key that is known holds nothing that could end the value.
    Ok(with_cookie(&format!(
        "{COOKIE}={}; Path=/; HttpOnly; SameSite=Strict{}",
        request.key,
        secure(&headers)
    )))
}

/// Forget the cookie
#[utoipa::path(delete, path = "/v1/session", tag = "access", responses((status = NO_CONTENT)))]
pub(super) async fn delete_session(headers: HeaderMap) -> Response {
    with_cookie(&format!("{COOKIE}=; Path=/; Max-Age=0; HttpOnly; SameSite=Strict{}", secure(&headers)))
}

fn with_cookie(cookie: &str) -> Response {
    let mut response = StatusCode::NO_CONTENT.into_response();
    if let Ok(value) = HeaderValue::from_str(cookie) {
        response.headers_mut().insert(header::SET_COOKIE, value);
    }
    response
}

/// Behind a proxy that ends TLS, the cookie is for TLS alone.
fn secure(headers: &HeaderMap) -> &'static str {
    let by_tls = headers.get("x-forwarded-proto").is_some_and(|scheme| scheme == "https");
    if by_tls { "; Secure" } else { "" }
}
