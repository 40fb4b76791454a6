//! Every address of the service, on one screen.

mod health;
mod page;
mod pictures;
mod plans;
mod renders;
mod scenes;

use crate::AppState;
use crate::problem::Problem;
use axum::Router;
use axum::extract::Request;
use axum::http::{HeaderValue, header};
use axum::middleware::{Next, from_fn};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use std::any::Any;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::trace::TraceLayer;

/// The service, without a listener.
pub fn router(state: AppState) -> Router {
    Router::new()
        .route("/v1/renders", post(renders::create_render).get(renders::list_renders))
        .route("/v1/renders/{id}", get(renders::get_render).delete(renders::delete_render))
        .route("/v1/renders/{id}/cancel", post(renders::cancel_render))
        .route("/v1/renders/{id}/scene.json", get(renders::get_render_scene))
        .route("/v1/renders/{id}/image.png", get(pictures::get_image_png))
        .route("/v1/renders/{id}/image.exr", get(pictures::get_image_exr))
        .route("/v1/renders/{id}/preview.png", get(pictures::get_preview))
        .route("/v1/renders/{id}/layers/{file}", get(pictures::get_layer))
        .route("/v1/plans", post(plans::create_plan))
        .route("/v1/schema", get(scenes::get_schema))
        .route("/v1/scenes", get(scenes::list_scenes))
        .route("/v1/scenes/{name}", get(scenes::get_scene))
        .route("/v1/scenes/{name}/picture.png", get(scenes::get_scene_picture))
        .route("/healthz", get(health::live))
        .route("/readyz", get(health::ready))
        .route("/", get(page::index))
        .route("/{file}", get(page::file))
        .fallback(async || Problem::not_found("There is nothing at this address."))
        .method_not_allowed_fallback(async || Problem::method_not_allowed())
        .with_state(state)
        .layer(CatchPanicLayer::custom(answer_panic))
        .layer(from_fn(harden))
        .layer(TraceLayer::new_for_http())
}

fn answer_panic(panic: Box<dyn Any + Send>) -> Response {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    Problem::internal(text.unwrap_or("panic without text")).into_response()
}

/// Headers that every answer carries: browsers guess no types and run nothing but the page's own files.
async fn harden(request: Request, next: Next) -> Response {
    const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
        connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    response
}
